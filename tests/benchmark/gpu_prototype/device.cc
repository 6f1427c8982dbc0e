#include "tests/benchmark/gpu_prototype/device.h"

#include <array>
#include <stdexcept>

namespace fulcrum::physics::gpu_prototype {

void Check(cl_int status, const char* call) {
  if (status != CL_SUCCESS)
    throw std::runtime_error(std::string(call) + " failed: OpenCL error " + std::to_string(status));
}

Device::Device() {
  cl_platform_id platform = nullptr;
  cl_uint count = 0;
  if (clGetPlatformIDs(1, &platform, &count) != CL_SUCCESS || count == 0 ||
      clGetDeviceIDs(platform, CL_DEVICE_TYPE_ALL, 1, &device_, &count) != CL_SUCCESS || count == 0) {
    throw std::runtime_error("no OpenCL device; on a CPU: apt-get install pocl-opencl-icd");
  }
  std::array<char, 256> name{};
  clGetDeviceInfo(device_, CL_DEVICE_NAME, name.size(), name.data(), nullptr);
  name_ = name.data();
  cl_device_fp_config floats = 0;
  clGetDeviceInfo(device_, CL_DEVICE_SINGLE_FP_CONFIG, sizeof(floats), &floats, nullptr);
  rounds_correctly_ = (floats & CL_FP_CORRECTLY_ROUNDED_DIVIDE_SQRT) != 0;
  cl_int status = CL_SUCCESS;
  context_ = clCreateContext(nullptr, 1, &device_, nullptr, nullptr, &status);
  Check(status, "clCreateContext");
  queue_ = clCreateCommandQueue(context_, device_, 0, &status);
  Check(status, "clCreateCommandQueue");
}

Device::~Device() {
  ReleaseProgram();
  clReleaseCommandQueue(queue_);
  clReleaseContext(context_);
}

void Device::ReleaseProgram() {
  for (const auto& [name, kernel] : kernels_) clReleaseKernel(kernel);
  kernels_.clear();
  if (program_ != nullptr) clReleaseProgram(program_);
  program_ = nullptr;
}

void Device::Build(const std::string& source, const std::string& options) {
  ReleaseProgram();
  const char* text = source.c_str();
  cl_int status = CL_SUCCESS;
  program_ = clCreateProgramWithSource(context_, 1, &text, nullptr, &status);
  Check(status, "clCreateProgramWithSource");
  const std::string all = options + (rounds_correctly_ ? " -cl-fp32-correctly-rounded-divide-sqrt" : "");
  if (clBuildProgram(program_, 1, &device_, all.c_str(), nullptr, nullptr) != CL_SUCCESS) {
    std::string log(65536, '\0');
    clGetProgramBuildInfo(program_, device_, CL_PROGRAM_BUILD_LOG, log.size(), log.data(), nullptr);
    throw std::runtime_error("the kernels do not compile:\n" + std::string(log.c_str()));
  }
  cl_uint count = 0;
  Check(clCreateKernelsInProgram(program_, 0, nullptr, &count), "clCreateKernelsInProgram");
  std::vector<cl_kernel> kernels(count);
  Check(clCreateKernelsInProgram(program_, count, kernels.data(), nullptr), "clCreateKernelsInProgram");
  for (const cl_kernel kernel : kernels) {
    std::array<char, 64> name{};
    clGetKernelInfo(kernel, CL_KERNEL_FUNCTION_NAME, name.size(), name.data(), nullptr);
    kernels_[name.data()] = kernel;
  }
}

Buffer Device::Make(std::size_t bytes) const {
  cl_int status = CL_SUCCESS;
  Buffer buffer(clCreateBuffer(context_, CL_MEM_READ_WRITE, bytes, nullptr, &status));
  Check(status, "clCreateBuffer");
  return buffer;
}

void Device::Enqueue(cl_kernel kernel, std::size_t items) {
  Check(clEnqueueNDRangeKernel(queue_, kernel, 1, nullptr, &items, nullptr, 0, nullptr, nullptr),
        "clEnqueueNDRangeKernel");
  ++traffic.launches;
}

void Device::WriteBytes(const Buffer& to, std::size_t first, const void* from, std::size_t bytes) {
  Check(clEnqueueWriteBuffer(queue_, to.get(), CL_TRUE, first, bytes, from, 0, nullptr, nullptr),
        "clEnqueueWriteBuffer");
  ++traffic.writes;
  traffic.bytes_written += bytes;
}

void Device::ReadBytes(const Buffer& from, std::size_t first, void* to, std::size_t bytes) {
  Check(clEnqueueReadBuffer(queue_, from.get(), CL_TRUE, first, bytes, to, 0, nullptr, nullptr), "clEnqueueReadBuffer");
  ++traffic.reads;
  traffic.bytes_read += bytes;
}

void Device::Finish() { Check(clFinish(queue_), "clFinish"); }

}  // namespace fulcrum::physics::gpu_prototype
