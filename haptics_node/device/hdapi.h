// The driver of the Touch (HDAPI, libHD.so), loaded at run time: nothing of it is needed to build. Names and numbers
// are the library's own; only what is used stands here.
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
inline constexpr Enum kCalibrationStyle = 0x2555;  ///< Integer, bit per style that the device knows.
inline constexpr Enum kMaxForce = 0x2603;          ///< Double [N].
inline constexpr Enum kMotorTemperature = 0x2605;  ///< 6 doubles, 0 cold … 1 hot.
inline constexpr Enum kCurrentForce = 0x2700;      ///< 3 doubles [N].
inline constexpr Enum kForceOutput = 0x4000;       ///< For enable and disable.

// Answers about the calibration, and its styles.
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

/// Loads the library for the rest of the process: its threads would not survive that it is unloaded.
/// @param library a path, or a name that the loader searches for.
/// Throws InputError that says what is missing and what to install.
[[nodiscard]] Api Load(const std::string& library);

}  // namespace fulcrum::haptics::hd
