#include "services/transport/bus/convert/cdr.h"

#include <fastcdr/Cdr.h>
#include <fastcdr/FastBuffer.h>
#include <fastcdr/exceptions/Exception.h>

#include <type_traits>

#include "services/transport/bus/convert/convert.h"
#include "services/transport/bus/convert/generated_types.h"

namespace fulcrum::bus {
namespace {

using eprosima::fastcdr::Cdr;
using eprosima::fastcdr::FastBuffer;

constexpr std::size_t kEncapsulation = 4;

}  // namespace

template <class T>
bool DecodeCdr(std::span<const std::uint8_t> bytes, T* message) {
  if constexpr (Loanable<T>) {
    return bytes.size() >= kEncapsulation && FromLoan(std::as_bytes(bytes.subspan(kEncapsulation)), message);
  } else {
    // The library only reads, but takes a non-const pointer.
    FastBuffer buffer(reinterpret_cast<char*>(const_cast<std::uint8_t*>(bytes.data())), bytes.size());
    Cdr cdr(buffer, Cdr::DEFAULT_ENDIAN, Cdr::DDS_CDR);
    try {
      WireOf<T> wire;
      cdr.read_encapsulation();
      wire.deserialize(cdr);
      FromWire(wire, message);
      return true;
    } catch (const eprosima::fastcdr::exception::Exception&) {
      return false;
    }
  }
}

template <class T>
bool EncodeCdr(const T& message, std::vector<std::uint8_t>* bytes) {
  if constexpr (Loanable<T>) {
    std::size_t vertices = 0;
    if constexpr (std::is_same_v<T, TissueFrame>) vertices = message.xyz.size() / 3;
    bytes->assign(kEncapsulation + LoanBytes(&message, vertices), 0);
    (*bytes)[1] = 1;  // Little-endian CDR.
    return ToLoan(message, std::as_writable_bytes(std::span(*bytes)).subspan(kEncapsulation));
  } else {
    WireOf<T> wire;
    if (!ToWire(message, &wire)) return false;
    FastBuffer buffer;
    Cdr cdr(buffer, Cdr::DEFAULT_ENDIAN, Cdr::DDS_CDR);
    cdr.serialize_encapsulation();
    wire.serialize(cdr);
    const auto* first = reinterpret_cast<const std::uint8_t*>(cdr.getBufferPointer());
    bytes->assign(first, first + cdr.getSerializedDataLength());
    return true;
  }
}

#define FULCRUM_INSTANTIATE(T)                                   \
  template bool DecodeCdr<T>(std::span<const std::uint8_t>, T*); \
  template bool EncodeCdr<T>(const T&, std::vector<std::uint8_t>*);
FULCRUM_MESSAGES(FULCRUM_INSTANTIATE)
#undef FULCRUM_INSTANTIATE

}  // namespace fulcrum::bus
