#include "services/base/runtime/checkpoint.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <cstring>
#include <string>
#include <utility>

#include "services/base/core/error.h"
#include "services/base/core/hash.h"
#include "services/base/runtime/file_descriptor.h"

namespace fulcrum::runtime {
namespace {

constexpr std::uint64_t kMagic = 0x32304b50434c5546ull;  // "FULCPK02" in memory order.
constexpr std::size_t kPage = 4096;

/// First page of the file: identifies the scene and layout of the two slots.
struct FileHeader {
  std::uint64_t magic;
  std::uint64_t scene_hash;
  std::uint64_t layout_version;
  std::uint64_t capacity;
  [[nodiscard]] bool operator==(const FileHeader&) const = default;
};

/// First page of a slot; the payload follows. `sequence` is the seal: 0 while the slot is being filled.
struct SlotHeader {
  std::uint64_t sequence;
  std::uint64_t bytes;
  std::uint64_t checksum;
};

/// Serial number arithmetic (RFC 1982): whatever sequence a file holds, the next one is newer. 0 marks an empty slot.
bool IsNewer(std::uint64_t sequence, std::uint64_t than) {
  return sequence != 0 && (than == 0 || static_cast<std::int64_t>(sequence - than) > 0);
}

std::uint64_t Next(std::uint64_t sequence) { return sequence + 1 == 0 ? 1 : sequence + 1; }

std::size_t RoundUpToPage(std::size_t bytes) { return (bytes + kPage - 1) / kPage * kPage; }

std::size_t SlotStride(std::size_t capacity) { return kPage + RoundUpToPage(capacity); }

std::uint64_t Checksum(std::uint64_t sequence, std::span<const std::byte> payload) {
  Hash64 hash;
  hash.AddValue(sequence);
  hash.AddLong(payload);
  return hash.value();
}

[[noreturn]] void Fail(const std::filesystem::path& file, const std::string& what) {
  throw InputError(file.string() + ": checkpoint cannot be " + what + ": " + std::strerror(errno));
}

/// One process at a time: two writers would seal each other's partly filled slots.
void Lock(const std::filesystem::path& file, int fd) {
  int result = ::flock(fd, LOCK_EX | LOCK_NB);
  // A check by IsInUse holds the lock for microseconds.
  for (int i = 0; i < 5 && result != 0 && errno == EWOULDBLOCK; ++i) {
    ::usleep(1000);
    result = ::flock(fd, LOCK_EX | LOCK_NB);
  }
  if (result != 0) {
    if (errno == EWOULDBLOCK) {
      throw InputError(file.string() + ": checkpoint is in use by another process; stop that node first");
    }
    Fail(file, "locked");
  }
}

std::string WhyUnusable(const FileHeader& found, const FileHeader& wanted) {
  constexpr std::uint64_t kName = 0xffffffffffffull;  // "FULCPK"; the rest of the magic is a version.
  if ((found.magic & kName) != (wanted.magic & kName)) return "is no checkpoint";
  if (found.magic != wanted.magic) return "is of another build";
  if (found.scene_hash != wanted.scene_hash) return "is of another scene";
  if (found.layout_version != wanted.layout_version) {
    return "has layout " + std::to_string(found.layout_version) + ", this build reads " +
           std::to_string(wanted.layout_version);
  }
  return "has not the size that its scene asks for";
}

/// The existing file, locked, if its header and size are as wanted; otherwise `complaint` receives the reason.
FileDescriptor OpenExisting(const std::filesystem::path& file, const FileHeader& wanted, std::size_t file_bytes,
                            std::string* complaint) {
  FileDescriptor fd(::open(file.c_str(), O_RDWR | O_CLOEXEC));
  if (fd.get() < 0) {
    if (errno == ENOENT) {
      return FileDescriptor();
    }
    Fail(file, "opened");
  }
  Lock(file, fd.get());
  FileHeader found{};
  struct stat info {};
  const bool usable = ::fstat(fd.get(), &info) == 0 && static_cast<std::size_t>(info.st_size) == file_bytes &&
                      ::pread(fd.get(), &found, sizeof(found), 0) == static_cast<ssize_t>(sizeof(found)) &&
                      found == wanted;
  if (!usable) *complaint = file.string() + " " + WhyUnusable(found, wanted) + ": replaced, the node begins anew";
  return usable ? std::move(fd) : FileDescriptor();
}

/// A new file gets its name only when its header is complete, so a kill in this function leaves the old state.
FileDescriptor Create(const std::filesystem::path& file, const FileHeader& header, std::size_t file_bytes) {
  std::filesystem::path fresh = file;
  fresh += ".new";
  FileDescriptor fd(::open(fresh.c_str(), O_RDWR | O_CREAT | O_TRUNC | O_CLOEXEC, 0600));
  if (fd.get() < 0) {
    Fail(file, "created");
  }
  Lock(file, fd.get());
  // Reserves the blocks here: a store into a mapped page on a full disk would be a SIGBUS later.
  if (const int error = ::posix_fallocate(fd.get(), 0, static_cast<off_t>(file_bytes)); error != 0) {
    errno = error;
    ::unlink(fresh.c_str());
    Fail(file, "given its room");
  }
  if (::pwrite(fd.get(), &header, sizeof(header), 0) != static_cast<ssize_t>(sizeof(header))) {
    Fail(file, "written");
  }
  if (::rename(fresh.c_str(), file.c_str()) != 0) {
    Fail(file, "renamed into place");
  }
  return fd;
}

}  // namespace

struct CheckpointFile::Impl {
  FileDescriptor fd;
  std::byte* map = nullptr;
  std::size_t file_bytes = 0;
  std::size_t slot_stride = 0;
  std::size_t capacity = 0;
  int newest = -1;  // Complete slot with the highest sequence.
  int filling = -1;
  std::uint64_t last_sequence = 0;
  std::string complaint;

  ~Impl() {
    if (map != nullptr) {
      ::munmap(map, file_bytes);
    }
  }
  [[nodiscard]] std::byte* slot(int i) const { return map + kPage + static_cast<std::size_t>(i) * slot_stride; }
  [[nodiscard]] SlotHeader* header(int i) const { return reinterpret_cast<SlotHeader*>(slot(i)); }
  [[nodiscard]] std::span<std::byte> payload(int i) const { return {slot(i) + kPage, capacity}; }

  [[nodiscard]] bool IsWhole(int i) const {
    const SlotHeader& h = *header(i);
    return h.sequence != 0 && h.bytes <= capacity && Checksum(h.sequence, payload(i).first(h.bytes)) == h.checksum;
  }
};

CheckpointFile::CheckpointFile(const std::filesystem::path& file, std::uint64_t scene_hash,
                               std::uint32_t layout_version, std::size_t capacity_bytes)
    : impl_(std::make_unique<Impl>()) {
  impl_->capacity = capacity_bytes;
  impl_->slot_stride = SlotStride(capacity_bytes);
  impl_->file_bytes = kPage + 2 * impl_->slot_stride;
  const FileHeader wanted{kMagic, scene_hash, layout_version, capacity_bytes};
  impl_->fd = OpenExisting(file, wanted, impl_->file_bytes, &impl_->complaint);
  if (impl_->fd.get() < 0) {
    impl_->fd = Create(file, wanted, impl_->file_bytes);
  }
  void* map = ::mmap(nullptr, impl_->file_bytes, PROT_READ | PROT_WRITE, MAP_SHARED, impl_->fd.get(), 0);
  if (map == MAP_FAILED) {
    Fail(file, "mapped");
  }
  impl_->map = static_cast<std::byte*>(map);
  bool altered = false;
  for (int i = 0; i < 2; ++i) {
    const std::uint64_t sequence = impl_->header(i)->sequence;
    if (!impl_->IsWhole(i)) {
      altered = altered || sequence != 0;  // A kill leaves no seal on an incomplete slot.
      impl_->header(i)->sequence = 0;
    } else if (IsNewer(sequence, impl_->last_sequence)) {
      impl_->newest = i;
      impl_->last_sequence = sequence;
    }
  }
  if (altered) {
    impl_->complaint = file.string() + " was altered from outside: the node " +
                       (impl_->newest < 0 ? "begins anew" : "goes on from what is whole");
  }
}

CheckpointFile::~CheckpointFile() = default;

std::optional<std::vector<std::byte>> CheckpointFile::Peek(const std::filesystem::path& file, std::uint64_t scene_hash,
                                                           std::uint32_t layout_version, std::size_t capacity_bytes) {
  const FileDescriptor fd(::open(file.c_str(), O_RDONLY | O_CLOEXEC));
  FileHeader found{};
  if (fd.get() < 0 || ::pread(fd.get(), &found, sizeof(found), 0) != static_cast<ssize_t>(sizeof(found)) ||
      found != FileHeader{kMagic, scene_hash, layout_version, capacity_bytes}) {
    return std::nullopt;
  }
  const std::size_t stride = kPage + RoundUpToPage(capacity_bytes);
  std::optional<std::vector<std::byte>> newest;
  std::uint64_t newest_sequence = 0;
  for (std::size_t i = 0; i < 2; ++i) {
    SlotHeader header{};
    const auto at = static_cast<off_t>(kPage + i * stride);
    if (::pread(fd.get(), &header, sizeof(header), at) != static_cast<ssize_t>(sizeof(header)) ||
        !IsNewer(header.sequence, newest_sequence) || header.bytes > capacity_bytes) {
      continue;
    }
    // The copy is checked, not the slot: the writer may continue meanwhile.
    std::vector<std::byte> payload(header.bytes);
    if (::pread(fd.get(), payload.data(), payload.size(), at + static_cast<off_t>(kPage)) ==
            static_cast<ssize_t>(payload.size()) &&
        Checksum(header.sequence, payload) == header.checksum) {
      newest_sequence = header.sequence;
      newest = std::move(payload);
    }
  }
  return newest;
}

std::optional<CheckpointFile::Loaded> CheckpointFile::Latest() const {
  if (impl_->newest < 0) {
    return std::nullopt;
  }
  const SlotHeader& h = *impl_->header(impl_->newest);
  return Loaded{h.sequence, impl_->payload(impl_->newest).first(h.bytes)};
}

std::optional<CheckpointFile::Loaded> CheckpointFile::Previous() const {
  const int other = impl_->newest == 0 ? 1 : 0;
  if (impl_->newest < 0 || !impl_->IsWhole(other)) return std::nullopt;
  const SlotHeader& h = *impl_->header(other);
  return Loaded{h.sequence, impl_->payload(other).first(h.bytes)};
}

const std::string& CheckpointFile::complaint() const { return impl_->complaint; }

// A kill ends the process between two instructions and the kernel keeps every store made so far, so only the order of
// the stores matters: the fences keep the compiler from moving payload stores across the seal.
std::span<std::byte> CheckpointFile::Begin() {
  impl_->filling = impl_->newest == 0 ? 1 : 0;
  impl_->header(impl_->filling)->sequence = 0;
  std::atomic_signal_fence(std::memory_order_seq_cst);
  return impl_->payload(impl_->filling);
}

void CheckpointFile::Commit(std::size_t bytes) {
  if (impl_->filling < 0 || bytes > impl_->capacity) {
    throw std::logic_error("CheckpointFile::Commit without Begin, or with more bytes than the capacity");
  }
  const int slot = std::exchange(impl_->filling, -1);
  SlotHeader* header = impl_->header(slot);
  const std::uint64_t sequence = Next(impl_->last_sequence);
  header->bytes = bytes;
  header->checksum = Checksum(sequence, impl_->payload(slot).first(bytes));
  std::atomic_signal_fence(std::memory_order_seq_cst);
  header->sequence = sequence;
  impl_->last_sequence = sequence;
  impl_->newest = slot;
}

bool IsInUse(const std::filesystem::path& file) {
  const FileDescriptor fd(::open(file.c_str(), O_RDONLY | O_CLOEXEC));
  // The lock is released when the descriptor is closed.
  return fd.get() >= 0 && ::flock(fd.get(), LOCK_SH | LOCK_NB) != 0 && errno == EWOULDBLOCK;
}

std::uint64_t NewestSequence(const std::filesystem::path& file) {
  const FileDescriptor fd(::open(file.c_str(), O_RDONLY | O_CLOEXEC));
  FileHeader header{};
  if (fd.get() < 0 || ::pread(fd.get(), &header, sizeof(header), 0) != static_cast<ssize_t>(sizeof(header)) ||
      header.magic != kMagic) {
    return 0;
  }
  std::uint64_t newest = 0;
  for (std::size_t i = 0; i < 2; ++i) {
    SlotHeader slot{};
    const auto at = static_cast<off_t>(kPage + i * SlotStride(header.capacity));
    if (::pread(fd.get(), &slot, sizeof(slot), at) == static_cast<ssize_t>(sizeof(slot)) &&
        IsNewer(slot.sequence, newest)) {
      newest = slot.sequence;
    }
  }
  return newest;
}

}  // namespace fulcrum::runtime
