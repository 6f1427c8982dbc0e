// The Touch through a stand-in of its driver, a shared library that is loaded like the driver.
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <limits>
#include <memory>
#include <numbers>
#include <string>
#include <thread>

#include "haptics_node/device/touch_device.h"
#include "haptics_node/device/touch_driver.h"
#include "services/base/core/error.h"
#include "tests/unit/haptics/rig.h"
#include "tests/unit/haptics/touch_rig.h"

namespace fulcrum::haptics {
namespace {

using testing::TickAt;
using testing::TouchRig;

constexpr std::int64_t kSecond_ns = 1'000'000'000;

const TouchDriver::WantedByTool kBoth{TouchDriver::Wanted{"Left Device", ""}, TouchDriver::Wanted{"Right Device", ""}};
const TouchDriver::WantedByTool kLeft{TouchDriver::Wanted{"Left Device", ""}, std::nullopt};

/// x to the right, y up, z towards the operator, rotated into a world with z up; trocar 100 mm below and in front of
/// the hand.
WorkspaceMap Map() {
  WorkspaceMap map;
  map.R_WD = RotationFromAngles(Vec3d(std::numbers::pi / 2, 0, 0));
  map.p_DP = Vec3d(0, -0.1, -0.1);
  map.p_WP = Vec3d(0, 0, 0.2);
  return map;
}

class Touch : public ::testing::Test {
 protected:
  void Open(const TouchDriver::WantedByTool& wanted, double force_scale = 1) {
    driver = std::make_shared<TouchDriver>(wanted, FULCRUM_HD_STAND_IN);
    for (std::size_t tool = 0; tool < devices.size(); ++tool) {
      if (wanted[tool]) devices[tool] = std::make_unique<TouchDevice>(driver, tool, Map(), force_scale, kParked);
    }
  }
  /// Runs driver and servo for so many milliseconds; the servo sends `force_W` to each tool.
  void Run(int count, const Vec3d& force_W = Vec3d::Zero()) {
    for (int i = 0; i < count; ++i) {
      rig.Tick();
      for (std::size_t tool = 0; tool < devices.size(); ++tool) {
        if (!devices[tool]) continue;
        position[tool] = devices[tool]->ReadPosition(TickAt(millisecond));
        devices[tool]->WriteForce(force_W);
      }
      ++millisecond;
    }
  }
  void Move(int device, const Vec3d& p_mm) {
    std::copy(p_mm.data(), p_mm.data() + 3, rig.hd->devices[device].position_mm.begin());
  }
  [[nodiscard]] Vec3d Force(int device) const { return Vec3d(rig.hd->devices[device].force_N.data()); }
  [[nodiscard]] std::string Misuse() const { return rig.hd->misuse.empty() ? "" : rig.hd->misuse.front(); }
  /// Maintenance 20 s after the last one: longer than the interval between retries beside a working device.
  void MaintainLater() {
    now_ns += 20 * kSecond_ns;
    driver->Maintain(now_ns);
  }

  const Vec3d kParked{0, 0, 0.35};
  TouchRig rig;
  std::shared_ptr<TouchDriver> driver;
  std::array<std::unique_ptr<TouchDevice>, kMaxTools> devices;
  std::array<Vec3d, kMaxTools> position{Vec3d::Zero(), Vec3d::Zero()};
  std::uint64_t millisecond = 0;
  std::int64_t now_ns = kSecond_ns;
};

std::string Refusal(const std::string& library) {
  try {
    const TouchDriver driver(kLeft, library);
  } catch (const InputError& error) {
    return error.what();
  }
  return "accepted";
}

TEST_F(Touch, MissingLibraryIsRefusedWithWhatToInstall) {
  const std::string said = Refusal("libHD_that_is_not_there.so");
  EXPECT_NE(said.find("the Touch needs libHD_that_is_not_there.so"), std::string::npos) << said;
  EXPECT_NE(said.find("Touch Device Driver"), std::string::npos) << said;
  EXPECT_NE(said.find("kind: simulated"), std::string::npos) << said;
}

TEST_F(Touch, LibraryWithoutAFunctionIsRefusedByName) {
  const std::string said = Refusal(FULCRUM_HD_FOLDER "/libHD_incomplete.so");
  EXPECT_NE(said.find("it lacks hdUpdateCalibration;"), std::string::npos) << said;
}

TEST_F(Touch, PositionsComeInMetresInTheWorldFrame) {
  Move(0, {10, 20, 30});
  Move(1, {-40, 0, 5});
  Open(kBoth);
  Run(1000);
  // R turns (x, y, z) of the device into (x, -z, y).
  EXPECT_LT((position[0] - Vec3d(0.010, -0.130, 0.2 + 0.120)).norm(), 1e-12);
  EXPECT_LT((position[1] - Vec3d(-0.040, -0.105, 0.2 + 0.100)).norm(), 1e-12);
  EXPECT_EQ(rig.hd->rate_Hz, 1000u);
  EXPECT_EQ(Misuse(), "");
}

TEST_F(Touch, ForcesGoToTheRightMotorsInTheDevicesFrame) {
  Open(kBoth, 0.5);
  Run(2000, Vec3d(0.2, 0.4, 0.6));
  // R^T: (x, y, z) of the world is (x, z, -y) of the device.
  for (int i : {0, 1}) EXPECT_LT((Force(i) - 0.5 * Vec3d(0.2, 0.6, -0.4)).norm(), 1e-9) << i;
  EXPECT_EQ(Misuse(), "");
}

TEST_F(Touch, ForceBeyondTheDevicesOwnLimitIsScaledToIt) {
  rig.hd->devices[0].max_force_N = 1.5;
  Open(kLeft);
  Run(2000, Vec3d(0, 3, 0));
  EXPECT_LT((Force(0) - Vec3d(0, 0, -1.5)).norm(), 1e-9);
  EXPECT_EQ(Misuse(), "");
}

TEST_F(Touch, StylusAxisAndButtonsAreRead) {
  // The stylus turned by 90 degrees about x: its -z axis points along +y of the device.
  rig.hd->devices[0].transform = {1, 0, 0, 0, 0, 0, 1, 0, 0, -1, 0, 0, 0, 0, 0, 1};
  rig.hd->devices[0].buttons = 3;
  Open(kLeft);
  rig.Tick();
  TouchSample sample;
  ASSERT_TRUE(driver->link(0).sample.TryTake(&sample));
  EXPECT_LT((sample.d_D - Vec3d::UnitY()).norm(), 1e-12);
  EXPECT_EQ(sample.buttons, 3);
}

TEST_F(Touch, ToolsArePairedBySerialNumberWhateverTheNamesSay) {
  Move(0, {10, 0, 0});
  Move(1, {20, 0, 0});
  // The names in the setup program are swapped against those in the cart.
  Open({TouchDriver::Wanted{"Left Device", "B200"}, TouchDriver::Wanted{"Right Device", "A100"}});
  Run(1000);
  EXPECT_EQ(driver->serial(0), "B200");
  EXPECT_EQ(driver->serial(1), "A100");
  EXPECT_NEAR(position[0].x(), 0.020, 1e-12);
  EXPECT_NEAR(position[1].x(), 0.010, 1e-12);
}

TEST_F(Touch, AnUnknownSerialNumberIsNamedBesideTheFoundOnes) {
  Open({TouchDriver::Wanted{"Left Device", "C300"}, std::nullopt});
  Run(100, Vec3d(1, 0, 0));
  EXPECT_EQ(driver->Trouble(0),
            "no Touch with serial number C300; found: A100 ('Left Device'); check `serial` in the "
            "cart file");
  EXPECT_EQ(position[0], kParked);
}

TEST_F(Touch, ADeviceThatIsNotThereIsTroubleUntilItIsPluggedIn) {
  rig.hd->devices[0].plugged = false;
  Open(kLeft);
  Run(100);
  EXPECT_EQ(position[0], kParked);
  const std::string said = devices[0]->Describe().trouble;
  EXPECT_NE(said.find("cannot open the Touch 'Left Device' (device fault): check its power and cable"),
            std::string::npos)
      << said;
  driver->Maintain(now_ns);
  rig.hd->devices[0].plugged = true;
  MaintainLater();
  EXPECT_EQ(driver->Trouble(0), "");
  Run(1000, Vec3d(1, 0, 0));
  EXPECT_GT(Force(0).norm(), 0.99);
  EXPECT_EQ(Misuse(), "");
}

TEST_F(Touch, ToolGlidesToTheHandAndForceRisesSoftlyAfterwards) {
  Move(0, {80, 0, 0});
  Open(kLeft);
  Run(1);
  Vec3d last = position[0];
  double last_force = 0;
  EXPECT_LT((last - kParked).norm(), 1e-12);
  for (int i = 0; i < 1000; ++i) {
    Run(1, Vec3d(1, 0, 0));
    EXPECT_LT((position[0] - last).norm(), 0.001) << i;  // Below 1 m/s over the 130 mm to the hand.
    EXPECT_LT(std::abs(Force(0).norm() - last_force), 0.005) << i;
    if (i < 400) {
      EXPECT_EQ(Force(0).norm(), 0) << i;
    }
    last = position[0];
    last_force = Force(0).norm();
  }
  EXPECT_NEAR(last.x(), 0.08, 1e-12);
  EXPECT_NEAR(last_force, 1, 1e-9);
}

TEST_F(Touch, UnpluggedDeviceHoldsTheToolAndComesBackWithoutARestart) {
  Open(kLeft);
  Run(1500, Vec3d(1, 0, 0));
  const Vec3d before = position[0];
  rig.hd->devices[0].plugged = false;
  Run(2, Vec3d(1, 0, 0));
  EXPECT_EQ(Force(0).norm(), 0);
  EXPECT_EQ(driver->losses(), 1u);
  EXPECT_NE(driver->Trouble(0).find("Touch A100 was lost (communication error): check its cable"), std::string::npos)
      << driver->Trouble(0);
  Run(400, Vec3d(1, 0, 0));
  EXPECT_EQ(position[0], before);
  EXPECT_EQ(devices[0]->Describe().gain, 0);
  MaintainLater();  // Still unplugged.
  EXPECT_NE(driver->Trouble(0).find("cannot open"), std::string::npos);
  rig.hd->devices[0].plugged = true;
  Move(0, {0, 30, 0});
  MaintainLater();
  Run(1, Vec3d(1, 0, 0));
  EXPECT_LT((position[0] - before).norm(), 1e-4);
  EXPECT_EQ(Force(0).norm(), 0);
  Run(1000, Vec3d(1, 0, 0));
  EXPECT_NEAR(position[0].z() - before.z(), 0.030, 1e-9);
  EXPECT_NEAR(Force(0).norm(), 1, 1e-9);
  EXPECT_EQ(driver->Trouble(0), "");
  EXPECT_EQ(Misuse(), "");
}

TEST_F(Touch, OneUnpluggedDeviceLeavesTheOtherAtWork) {
  Open(kBoth);
  Run(1500, Vec3d(1, 0, 0));
  rig.hd->devices[1].plugged = false;
  Run(500, Vec3d(1, 0, 0));
  EXPECT_NEAR(Force(0).norm(), 1, 1e-9);
  EXPECT_EQ(Force(1).norm(), 0);
  EXPECT_EQ(driver->Trouble(0), "");
  EXPECT_NE(driver->Trouble(1), "");
  // Retried at once, then only every ten seconds, because each retry interrupts the other device.
  const int inits = rig.hd->inits;
  for (int i = 0; i < 100; ++i) driver->Maintain(now_ns += kSecond_ns / 10);
  EXPECT_EQ(rig.hd->inits, inits + 1);
}

TEST_F(Touch, SchedulerThatHangsFadesTheForceAndIsStartedAgain) {
  Open(kLeft);
  Run(1500, Vec3d(1, 0, 0));
  driver->Maintain(now_ns);
  rig.hd->stalled = true;
  Run(400, Vec3d(1, 0, 0));
  EXPECT_EQ(devices[0]->Describe().gain, 0);
  rig.hd->stalled = false;
  driver->Maintain(now_ns += kSecond_ns);
  Run(1500, Vec3d(1, 0, 0));
  EXPECT_NEAR(Force(0).norm(), 1, 1e-9);
  EXPECT_EQ(driver->losses(), 1u);
}

TEST_F(Touch, ServoThatStopsLetsGoOfTheHand) {
  Open(kLeft);
  Run(1500, Vec3d(1, 0, 0));
  for (int i = 0; i < 19; ++i) rig.Tick();
  EXPECT_NEAR(Force(0).norm(), 1, 1e-9);
  double last = 1;
  for (int i = 0; i < 105; ++i) {
    rig.Tick();
    EXPECT_LE(Force(0).norm(), last);
    EXPECT_LT(last - Force(0).norm(), 0.011);
    last = Force(0).norm();
  }
  EXPECT_EQ(last, 0);
}

TEST_F(Touch, HeatFadesTheForceBeforeTheDriverCutsIt) {
  Open(kLeft);
  Run(1500, Vec3d(1, 0, 0));
  double last = 1;
  // Motors warm up from 0.6 to 0.94 within 10 s.
  for (int i = 0; i < 10'000; ++i) {
    rig.hd->devices[0].heat[2] = 0.6 + 0.34e-4 * i;
    Run(1, Vec3d(1, 0, 0));
    EXPECT_LE(Force(0).norm(), last + 1e-12);
    EXPECT_LT(last - Force(0).norm(), 0.002);
    last = Force(0).norm();
  }
  // The heat is read every 100 ms.
  EXPECT_NEAR(last, (kMotorHot - 0.94) / (kMotorHot - kMotorWarm), 0.34e-4 * 100 / (kMotorHot - kMotorWarm) + 1e-9);
  const DeviceHealth hot = devices[0]->Describe();
  EXPECT_NEAR(hot.motor_heat, 0.94, 0.01);
  EXPECT_NE(hot.trouble.find("Touch A100 has warm motors"), std::string::npos) << hot.trouble;
  rig.hd->devices[0].heat[2] = 0.3;
  Run(1500, Vec3d(1, 0, 0));
  EXPECT_NEAR(Force(0).norm(), 1, 1e-9);
  EXPECT_EQ(devices[0]->Describe().trouble, "");
}

TEST_F(Touch, WarmMotorsErrorTurnsTheForceOffAndItReturnsSoftly) {
  Open(kLeft);
  Run(1500, Vec3d(1, 0, 0));
  rig.hd->devices[0].heat[0] = 1.0;
  Run(1200, Vec3d(1, 0, 0));
  EXPECT_EQ(devices[0]->Describe().gain, 0);
  EXPECT_NE(driver->Trouble(0).find("hot motors"), std::string::npos) << driver->Trouble(0);
  rig.hd->devices[0].heat[0] = 0.2;
  double last = 0;
  for (int i = 0; i < 2500; ++i) {
    Run(1, Vec3d(1, 0, 0));
    EXPECT_LT(Force(0).norm() - last, 0.002);
    last = Force(0).norm();
  }
  EXPECT_NEAR(last, 1, 1e-9);
  EXPECT_EQ(driver->losses(), 0u);
}

TEST_F(Touch, ARefusedForceIsShownForASecondAndTheDeviceGoesOn) {
  Open(kLeft);
  Run(1500, Vec3d(1, 0, 0));
  rig.hd->devices[0].error = 0x0203;
  Run(2, Vec3d(1, 0, 0));
  EXPECT_EQ(driver->Trouble(0),
            "Touch A100 has refused a force (maximum velocity exceeded): move it more slowly, or "
            "lower force_scale");
  Run(1000, Vec3d(1, 0, 0));
  EXPECT_EQ(driver->Trouble(0), "");
  EXPECT_NEAR(Force(0).norm(), 1, 1e-9);
  EXPECT_EQ(driver->losses(), 0u);
}

TEST_F(Touch, UncalibratedDeviceIsSilentUntilTheStylusWasInTheInkwell) {
  rig.hd->devices[0].calibration = 0x5002;
  Open(kLeft);
  Run(500, Vec3d(1, 0, 0));
  EXPECT_EQ(position[0], kParked);
  EXPECT_EQ(Force(0).norm(), 0);
  EXPECT_NE(driver->Trouble(0).find("not calibrated: put the stylus into the inkwell"), std::string::npos);
  rig.hd->devices[0].calibration = 0x5001;  // The stylus is in the inkwell.
  Run(1500, Vec3d(1, 0, 0));
  EXPECT_EQ(rig.hd->devices[0].calibration_updates, 1);
  EXPECT_EQ(driver->Trouble(0), "");
  EXPECT_NEAR(Force(0).norm(), 1, 1e-9);
  EXPECT_EQ(Misuse(), "");
}

TEST_F(Touch, PositionsThatAreNoPlaceAreNeverUsed) {
  Open(kLeft);
  Run(1500, Vec3d(1, 0, 0));
  const Vec3d before = position[0];
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const Vec3d& bad : {Vec3d(nan, 0, 0), Vec3d(0, 1e9, 0), Vec3d(0, 0, std::numeric_limits<double>::infinity())}) {
    Move(0, bad);
    Run(5, Vec3d(1, 0, 0));
    EXPECT_EQ(position[0], before);
  }
  EXPECT_NE(driver->Trouble(0).find("no valid position"), std::string::npos);
  Run(400, Vec3d(1, 0, 0));
  EXPECT_EQ(Force(0).norm(), 0);  // An error that persists is treated like an unplugged device.
  Move(0, Vec3d::Zero());
  Run(1000, Vec3d(1, 0, 0));
  EXPECT_NEAR(Force(0).norm(), 1, 1e-9);
}

// The library's thread against the servo's: for the thread sanitizer, and for faults that require two threads.
TEST_F(Touch, WorksWithASchedulerOnAThreadOfItsOwn) {
  rig.hd->threaded = true;
  Move(0, {10, 0, 0});
  Open(kLeft);
  driver->Start();
  // For any delay of either thread the tool reaches the hand.
  for (std::uint64_t i = 0; std::abs(position[0].x() - 0.010) > 1e-12; ++i) {
    position[0] = devices[0]->ReadPosition(TickAt(5 * i));
    devices[0]->WriteForce(Vec3d(1, 0, 0));
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  rig.hd->devices[0].plugged = false;
  while (driver->losses() == 0) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  rig.hd->devices[0].plugged = true;
  while (!driver->Trouble(0).empty()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  devices[0].reset();
  driver.reset();
  EXPECT_EQ(Misuse(), "");
  EXPECT_FALSE(rig.hd->devices[0].open);
}

TEST_F(Touch, ButtonsAndTheTurnOfTheStylusArrive) {
  Open(kLeft);
  Run(600);
  EXPECT_EQ(devices[0]->ReadButtons(), 0);
  rig.hd->devices[0].buttons = 3;
  Run(5);
  EXPECT_EQ(devices[0]->ReadButtons(), 3);
  // Three quarters of a turn about the stylus, in steps; its axis is the device's z, so the tool's points to -z.
  const float before = devices[0]->ReadRoll();
  for (int i = 1; i <= 90; ++i) {
    const double angle = -3 * std::numbers::pi / 180 * i;
    auto& transform = rig.hd->devices[0].transform;
    transform[0] = transform[5] = std::cos(angle);
    transform[1] = std::sin(angle);
    transform[4] = -std::sin(angle);
    Run(2);
  }
  EXPECT_NEAR(devices[0]->ReadRoll() - before, 1.5 * std::numbers::pi, 0.01) << "without a jump at half a turn";
  rig.hd->devices[0].plugged = false;
  Run(200);
  EXPECT_EQ(devices[0]->ReadButtons(), 0) << "a lost device presses nothing";
  EXPECT_NEAR(devices[0]->ReadRoll() - before, 1.5 * std::numbers::pi, 0.01) << "and does not turn the tool";
}

TEST_F(Touch, AStylusThatWasTurnedWhileItWasLostTurnsTheToolSlowly) {
  Open(kLeft);
  Run(600);
  for (int i = 0; i < 30; ++i) (void)devices[0]->ReadPosition(TickAt(millisecond++));  // The driver is held up.
  const float before = devices[0]->ReadRoll();
  auto& transform = rig.hd->devices[0].transform;
  transform[0] = transform[5] = 0;
  transform[1] = -1;
  transform[4] = 1;
  float last = before;
  for (int i = 0; i < 700; ++i) {
    Run(1);
    ASSERT_LT(std::abs(devices[0]->ReadRoll() - last), 0.02f) << i << " ms";
    last = devices[0]->ReadRoll();
  }
  EXPECT_NEAR(std::abs(last - before), 0.5 * std::numbers::pi, 0.01);
}

}  // namespace
}  // namespace fulcrum::haptics
