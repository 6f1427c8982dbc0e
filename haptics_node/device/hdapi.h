// Interface of the Touch's driver (HDAPI, libHD.so). The library is loaded at run time, so the build needs no file of
// it. Names and values are those of the library, restricted to what is used.
#pragma once

#include <string>

namespace fulcrum::haptics::hd {

using Handle = unsigned;
using Enum = unsigned;
using SchedulerHandle = unsigned long;
using Callback = unsigned (*)(void*);

struct ErrorInfo {
  unsigned code;
  int internal_code;
  Handle device;
};

inline constexpr Handle kInvalidHandle = 0xffffffffu;
inline constexpr unsigned kCallbackContinue = 1;
inline constexpr unsigned short kDefaultPriority = 0x7fff;

// Values to get and set.
inline constexpr Enum kCurrentButtons = 0x2000;    ///< Integer, bit per button.
inline constexpr Enum kCurrentPosition = 0x2050;   ///< 3 doubles [mm].
inline constexpr Enum kCurrentTransform = 0x2052;  ///< 16 doubles, column-major, translation in mm.
inline constexpr Enum kSerialNumber = 0x2504;      ///< String.
inline constexpr Enum kCalibrationStyle = 0x2555;  ///< Integer, bit per style that the device supports.
inline constexpr Enum kMaxForce = 0x2603;          ///< Double [N].
inline constexpr Enum kMotorTemperature = 0x2605;  ///< 6 doubles, 0 cold … 1 hot.
inline constexpr Enum kCurrentForce = 0x2700;      ///< 3 doubles [N].
inline constexpr Enum kForceOutput = 0x4000;       ///< Capability for Enable() and Disable().

// Results of CheckCalibration(), and calibration styles.
inline constexpr Enum kCalibrationOk = 0x5000, kCalibrationNeedsUpdate = 0x5001;
inline constexpr Enum kEncoderReset = 1, kAutomatic = 2, kInkwell = 4;

// Errors.
inline constexpr unsigned kWarmMotors = 0x0200, kMaxForceExceeded = 0x0201, kForceError = 0x0204;
inline constexpr unsigned kDeviceFault = 0x0300, kCommError = 0x0302, kTimerError = 0x0304;

/// The functions of the library, under its names without "hd".
struct Api {
  Handle (*InitDevice)(const char*);
  void (*DisableDevice)(Handle);
  void (*MakeCurrentDevice)(Handle);
  void (*BeginFrame)(Handle);
  void (*EndFrame)(Handle);
  ErrorInfo (*GetError)();
  const char* (*GetErrorString)(unsigned);
  void (*Enable)(Enum);
  void (*Disable)(Enum);
  const char* (*GetString)(Enum);
  void (*GetIntegerv)(Enum, int*);
  void (*GetDoublev)(Enum, double*);
  void (*SetDoublev)(Enum, const double*);
  void (*StartScheduler)();
  void (*StopScheduler)();
  void (*SetSchedulerRate)(unsigned long);
  SchedulerHandle (*ScheduleAsynchronous)(Callback, void*, unsigned short);
  void (*Unschedule)(SchedulerHandle);
  Enum (*CheckCalibration)();
  void (*UpdateCalibration)(Enum);
};

/// Loads the library. It is never unloaded, because its threads keep running.
/// @param library a path, or a name that the loader searches for.
/// Throws InputError that names what is missing and what to install.
[[nodiscard]] Api Load(const std::string& library);

}  // namespace fulcrum::haptics::hd
