#include "haptics_node/device/hdapi.h"

#include <dlfcn.h>

#include "services/base/core/error.h"

namespace fulcrum::haptics::hd {
namespace {

constexpr const char* kRemedy =
    "; install the Touch's driver for Linux (3D Systems: Touch Device Driver and OpenHaptics, which bring libHD.so and "
    "its setup program), run ldconfig, or name its folder in LD_LIBRARY_PATH; without a device take `kind: simulated` "
    "in the cart file";

class Loader {
 public:
  explicit Loader(const std::string& library) : library_(::dlopen(library.c_str(), RTLD_NOW | RTLD_GLOBAL)) {
    if (library_ == nullptr) {
      const char* why = ::dlerror();
      throw InputError("the Touch needs " + library + ", which cannot be loaded (" +
                       (why != nullptr ? why : "no reason given") + ")" + kRemedy);
    }
  }

  template <class Function>
  void Find(const char* symbol, Function* function) {
    *function = reinterpret_cast<Function>(::dlsym(library_, symbol));
    if (*function != nullptr) return;
    missing_ += ' ';
    missing_ += symbol;
  }

  [[nodiscard]] const std::string& missing() const { return missing_; }

 private:
  void* library_;
  std::string missing_;
};

}  // namespace

Api Load(const std::string& library) {
  Loader loader(library);
  Api api{};
  loader.Find("hdInitDevice", &api.InitDevice);
  loader.Find("hdDisableDevice", &api.DisableDevice);
  loader.Find("hdMakeCurrentDevice", &api.MakeCurrentDevice);
  loader.Find("hdBeginFrame", &api.BeginFrame);
  loader.Find("hdEndFrame", &api.EndFrame);
  loader.Find("hdGetError", &api.GetError);
  loader.Find("hdGetErrorString", &api.GetErrorString);
  loader.Find("hdEnable", &api.Enable);
  loader.Find("hdDisable", &api.Disable);
  loader.Find("hdGetString", &api.GetString);
  loader.Find("hdGetIntegerv", &api.GetIntegerv);
  loader.Find("hdGetDoublev", &api.GetDoublev);
  loader.Find("hdSetDoublev", &api.SetDoublev);
  loader.Find("hdStartScheduler", &api.StartScheduler);
  loader.Find("hdStopScheduler", &api.StopScheduler);
  loader.Find("hdSetSchedulerRate", &api.SetSchedulerRate);
  loader.Find("hdScheduleAsynchronous", &api.ScheduleAsynchronous);
  loader.Find("hdUnschedule", &api.Unschedule);
  loader.Find("hdCheckCalibration", &api.CheckCalibration);
  loader.Find("hdUpdateCalibration", &api.UpdateCalibration);
  if (!loader.missing().empty()) {
    throw InputError(library + " is no HDAPI of version 3 or later: it lacks" + loader.missing() + kRemedy);
  }
  return api;
}

}  // namespace fulcrum::haptics::hd
