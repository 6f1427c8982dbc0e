#include "services/transport/bus/convert/convert.h"

#include <string>

#include "services/transport/bus/convert/pieces.h"

namespace fulcrum::bus {
namespace {

static_assert(idl::MAX_TOOLS == kMaxTools && idl::MAX_CONTACTS == kMaxContacts && idl::NO_TRIANGLE == kNoIndex);
static_assert(idl::PEDAL_CUT == kPedalCut && idl::PEDAL_COAG == kPedalCoag && idl::PEDAL_BLEND == kPedalBlend);
static_assert(idl::OPERATOR_PROGRAM == static_cast<int>(OperatorSource::kProgram) &&
              idl::OPERATOR_BROWSER == static_cast<int>(OperatorSource::kBrowser));
static_assert(idl::TOOL_CLIP_APPLIER == static_cast<int>(ToolKind::kClipApplier) && idl::MAX_CLIPS == kMaxClips);
static_assert(idl::SERVO_RISE == static_cast<int>(ServoState::kRise));
static_assert(idl::CONTACT_GRASP == static_cast<int>(ContactKind::kGrasp));
static_assert(idl::MAX_FOOTPRINT == kFootprintCells * kFootprintCells && idl::OPEN_WINDOW == kOpenWindow);
static_assert(idl::MAX_MEMBRANE_NODES == kMaxMembraneNodes && idl::MAX_EDGES == 3 * kMaxMembraneNodes);
static_assert(idl::MAX_NODE_BYTES == kMaxMembraneNodes / 8 && idl::MAX_EDGE_BYTES == 3 * kMaxMembraneNodes / 8);
static_assert(idl::EVENT_SOLID_BURN == static_cast<int>(ThermalEventKind::kSolidBurn));
static_assert(idl::NO_SOLID == kNoSolid);
static_assert(idl::SURFACE_SOLIDS == static_cast<int>(BurntSurface::kSolids));
static_assert(idl::NODE_RECORDER == kNodeCount - 1 && idl::NODE_PHYSICS == static_cast<int>(NodeId::kPhysics));
static_assert(idl::MODE_LOCK_STEP == static_cast<int>(SessionMode::kLockStep));
static_assert(idl::HEALTH_STOPPING == static_cast<int>(HealthState::kStopping));
static_assert(idl::MAX_CONSUMED == kMaxConsumedInputs && idl::MAX_INPUT_HEALTHS == kMaxInputHealths &&
              idl::MAX_METRICS == kMaxMetrics);

/// Largest number of bytes of a text that fits, up to a character boundary of UTF-8.
std::size_t FittingLength(const std::string& text, std::size_t most) {
  if (text.size() <= most) return text.size();
  while (most > 0 && (static_cast<unsigned char>(text[most]) & 0xc0u) == 0x80u) --most;
  return most;
}

/// The text for people that is cut if it is too long; most messages have none.
template <class T>
struct CutText {
  static constexpr std::size_t most = 0;
};
template <>
struct CutText<Health> {
  static constexpr std::size_t most = kMaxErrorText;
  static constexpr auto member = &Health::last_error;
};

}  // namespace

template <class T>
bool ToWire(const T& from, WireOf<T>* to) {
  if constexpr (Loanable<T>) {
    return false;
  } else {
    using Text = CutText<T>;
    if constexpr (Text::most > 0) {
      const std::string& text = from.*Text::member;
      if (text.size() > Text::most) {
        T shorter = from;
        (shorter.*Text::member).resize(FittingLength(text, Text::most));
        return convert::Put(shorter, to);
      }
    }
    return convert::Put(from, to);
  }
}

template <class T>
void FromWire(const WireOf<T>& from, T* to) {
  if constexpr (!Loanable<T>) convert::Get(from, to);
}

#define FULCRUM_INSTANTIATE(T)                   \
  template bool ToWire<T>(const T&, WireOf<T>*); \
  template void FromWire<T>(const WireOf<T>&, T*);
FULCRUM_MESSAGES(FULCRUM_INSTANTIATE)
#undef FULCRUM_INSTANTIATE

}  // namespace fulcrum::bus
