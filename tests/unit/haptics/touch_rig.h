// The stand-in for the Touch's driver, loaded in the same way as by the code under test.
#pragma once

#include <dlfcn.h>

#include <stdexcept>

#include "tests/unit/haptics/stand_in/hd_stand_in.h"

namespace fulcrum::haptics::testing {

class TouchRig {
 public:
  TouchRig() {
    void* library = ::dlopen(FULCRUM_HD_STAND_IN, RTLD_NOW | RTLD_GLOBAL);
    if (library == nullptr) throw std::runtime_error(::dlerror());
    tick_ = reinterpret_cast<StandInTick>(::dlsym(library, "hd_stand_in_tick"));
    hd = reinterpret_cast<StandInReset>(::dlsym(library, "hd_stand_in_reset"))();
  }
  /// One period of the driver's scheduler.
  void Tick() const { tick_(); }

  StandIn* hd;

 private:
  StandInTick tick_;
};

}  // namespace fulcrum::haptics::testing
