// The first OpenCL device: buffers, programs, launches in one queue, and what they cost.
#pragma once

#define CL_TARGET_OPENCL_VERSION 120
#include <CL/cl.h>

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <type_traits>
#include <vector>

namespace fulcrum::physics::gpu_prototype {

/// Throws std::runtime_error with the call that failed.
void Check(cl_int status, const char* call);

struct ReleaseMemory {
  void operator()(cl_mem memory) const { clReleaseMemObject(memory); }
};
using Buffer = std::unique_ptr<std::remove_pointer_t<cl_mem>, ReleaseMemory>;

/// What has been asked of the device since the last reset.
struct Traffic {
  int launches = 0, reads = 0, writes = 0;
  std::uint64_t bytes_read = 0, bytes_written = 0;
};

class Device {
 public:
  /// Throws std::runtime_error when there is none.
  Device();
  ~Device();
  Device(const Device&) = delete;
  Device& operator=(const Device&) = delete;

  [[nodiscard]] const std::string& name() const { return name_; }
  /// Division and square root round as on the host.
  [[nodiscard]] bool rounds_correctly() const { return rounds_correctly_; }

  /// Replaces the program. Throws std::runtime_error with the compiler's output.
  void Build(const std::string& source, const std::string& options);

  [[nodiscard]] Buffer Make(std::size_t bytes) const;
  template <class Range>
  [[nodiscard]] Buffer MakeFrom(const Range& values) {
    Buffer buffer = Make(sizeof(*values.data()) * values.size());
    Write(buffer, 0, values.data(), values.size());
    return buffer;
  }
  /// `count` values to or from position `first` of a buffer; waits for all before them.
  template <class T>
  void Write(const Buffer& to, std::size_t first, const T* from, std::size_t count) {
    WriteBytes(to, sizeof(T) * first, from, sizeof(T) * count);
  }
  template <class T>
  void Read(const Buffer& from, std::size_t first, T* to, std::size_t count) {
    ReadBytes(from, sizeof(T) * first, to, sizeof(T) * count);
  }
  /// Appends a kernel over `items` to the queue.
  template <class... Arguments>
  void Launch(const char* kernel, std::size_t items, const Arguments&... arguments) {
    const cl_kernel k = kernels_.at(kernel);
    cl_uint index = 0;
    (SetArgument(k, index++, arguments), ...);
    Enqueue(k, items);
  }
  /// Waits until the queue is empty.
  void Finish();

  Traffic traffic;

 private:
  static void SetArgument(cl_kernel kernel, cl_uint index, const Buffer& buffer) {
    const cl_mem memory = buffer.get();
    Check(clSetKernelArg(kernel, index, sizeof(memory), &memory), "clSetKernelArg");
  }
  template <class T>
  requires std::is_arithmetic_v<T>
  static void SetArgument(cl_kernel kernel, cl_uint index, T value) {
    Check(clSetKernelArg(kernel, index, sizeof(value), &value), "clSetKernelArg");
  }
  void Enqueue(cl_kernel kernel, std::size_t items);
  void WriteBytes(const Buffer& to, std::size_t first, const void* from, std::size_t bytes);
  void ReadBytes(const Buffer& from, std::size_t first, void* to, std::size_t bytes);
  void ReleaseProgram();

  cl_device_id device_ = nullptr;
  cl_context context_ = nullptr;
  cl_command_queue queue_ = nullptr;
  cl_program program_ = nullptr;
  std::map<std::string, cl_kernel> kernels_;
  std::string name_;
  bool rounds_correctly_ = false;
};

}  // namespace fulcrum::physics::gpu_prototype
