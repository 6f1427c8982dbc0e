// The mean of jittered pictures against the exact coverage of each pixel, at rest and enlarged, and what moves.
#include "render_node/geometry/temporal_filter.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <vector>

namespace fulcrum::render {
namespace {

constexpr int kWidth = 96, kHeight = 64;
constexpr std::uint32_t kOpaque = 0xff000000u;

/// Grey [0, 255] at a place of the picture [pixels of the mean].
using Scene = std::function<double(double x, double y)>;

std::uint32_t Grey(double value) {
  const auto byte = static_cast<std::uint32_t>(std::lround(value));
  return kOpaque | byte << 16 | byte << 8 | byte;
}
int Red(std::uint32_t pixel) { return static_cast<int>(pixel & 0xff); }

/// A strip with slanted edges: bright on one side of each.
double Strip(double x, double y) {
  const double across = 0.9 * x + 0.35 * y - 50;
  return std::abs(across) < 7.3 ? 200 : 40;
}

/// Mean of 16 by 16 samples a pixel.
std::vector<double> Exact(const Scene& scene) {
  constexpr int kFine = 16;
  std::vector<double> exact;
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      double sum = 0;
      for (int k = 0; k < kFine * kFine; ++k) {
        sum += scene(x + (k % kFine + 0.5) / kFine, y + (k / kFine + 0.5) / kFine);
      }
      exact.push_back(sum / (kFine * kFine));
    }
  }
  return exact;
}

/// Pictures of one sample a pixel, as a renderer with a jittered projection draws them.
class Camera {
 public:
  explicit Camera(double scale)
      : width_(static_cast<int>(std::lround(scale * kWidth))), height_(static_cast<int>(std::lround(scale * kHeight))) {
    filter_.SetSize(kWidth, kHeight, width_, height_);
  }

  void Draw(const Scene& scene, bool still = false) {
    const Vec2d jitter = filter_.jitter().cast<double>();
    for (int y = 0; y < height_; ++y) {
      for (int x = 0; x < width_; ++x) {
        const double at_x = (x + 0.5 - jitter.x()) * kWidth / width_, at_y = (y + 0.5 - jitter.y()) * kHeight / height_;
        filter_.picture()[static_cast<std::size_t>(y * width_ + x)] = Grey(scene(at_x, at_y));
      }
    }
    filter_.Add(still);
  }
  void DrawPeriods(int periods, const Scene& scene) {
    for (int k = 0; k < periods * filter_.period(); ++k) Draw(scene);
  }

  /// Mean difference from the exact picture, over the pixels that an edge crosses.
  [[nodiscard]] double EdgeError(const std::vector<double>& exact) const {
    double sum = 0;
    int count = 0;
    for (std::size_t k = 0; k < exact.size(); ++k) {
      if (exact[k] <= 40 || exact[k] >= 200) continue;
      sum += std::abs(Red(filter_.shown()[k]) - exact[k]);
      ++count;
    }
    EXPECT_GT(count, 100);
    return sum / count;
  }
  [[nodiscard]] std::vector<std::uint32_t> shown() const { return {filter_.shown().begin(), filter_.shown().end()}; }
  [[nodiscard]] TemporalFilter& filter() { return filter_; }

 private:
  int width_, height_;
  TemporalFilter filter_;
};

/// Mean error of one sample in the middle of each pixel, enlarged bilinearly.
double SingleError(const std::vector<double>& exact, double scale) {
  const double width = std::lround(scale * kWidth), height = std::lround(scale * kHeight);
  const auto sample = [&](double x, double y) {
    x = std::clamp(x, 0.0, width - 1);
    y = std::clamp(y, 0.0, height - 1);
    return Strip((x + 0.5) * kWidth / width, (y + 0.5) * kHeight / height);
  };
  double sum = 0;
  int count = 0;
  for (int k = 0; k < kWidth * kHeight; ++k) {
    const double is = exact[static_cast<std::size_t>(k)];
    if (is <= 40 || is >= 200) continue;
    const double x = (k % kWidth + 0.5) * width / kWidth - 0.5, y = (k / kWidth + 0.5) * height / kHeight - 0.5;
    const double left = std::floor(x), low = std::floor(y), right = x - left, up = y - low;
    sum += std::abs((1 - up) * ((1 - right) * sample(left, low) + right * sample(left + 1, low)) +
                    up * ((1 - right) * sample(left, low + 1) + right * sample(left + 1, low + 1)) - is);
    ++count;
  }
  return sum / count;
}

TEST(JitterOf, CoversAPixelEvenly) {
  for (const int period : {8, 11, 15, 30, 64}) {
    Vec2f sum = Vec2f::Zero();
    std::array<int, 4> quarters{};
    for (int k = 0; k < period; ++k) {
      const Vec2f jitter = JitterOf(k, period);
      EXPECT_LT(jitter.cwiseAbs().maxCoeff(), 0.65f);
      EXPECT_EQ(JitterOf(k + period, period), jitter);
      sum += jitter;
      ++quarters.at((jitter.x() > 0 ? 1 : 0) + (jitter.y() > 0 ? 2 : 0));
    }
    EXPECT_LT(sum.norm() / static_cast<float>(period), 1e-5f) << "the mean would be shifted";
    for (const int quarter : quarters) EXPECT_GE(quarter, period / 6) << period;
  }
}

TEST(JitterPeriod, HasEightSamplesInAPixel) {
  EXPECT_EQ(JitterPeriod(1), 8);
  EXPECT_EQ(JitterPeriod(0.5f), 32);
  EXPECT_EQ(JitterPeriod(0.13f), 64) << "bounded";
  EXPECT_EQ(JitterPeriod(0), 64);
  EXPECT_EQ(JitterPeriod(4), 8);
}

TEST(TemporalFilter, SmoothsEdgesAtRest) {
  const std::vector<double> exact = Exact(Strip);
  for (const double scale : {1.0, 0.72, 0.52}) {
    Camera camera(scale);
    camera.DrawPeriods(2, Strip);
    EXPECT_LT(camera.EdgeError(exact), SingleError(exact, scale) / 2.5) << scale;
  }
}

TEST(TemporalFilter, ShowsTheSameWhileNothingMoves) {
  Camera camera(0.72), later(0.72);
  camera.DrawPeriods(2, Strip);
  const std::vector<std::uint32_t> shown = camera.shown();
  for (int k = 0; k < 40; ++k) {
    camera.Draw(Strip);
    EXPECT_EQ(camera.shown(), shown) << k;
  }
  // Another state in between leaves no trace.
  later.DrawPeriods(3, [](double x, double y) { return x > y ? 250 : 3; });
  later.DrawPeriods(2, Strip);
  EXPECT_EQ(later.shown(), shown);
}

TEST(TemporalFilter, IsCompleteAfterOnePeriodOfAStillScene) {
  Camera camera(1), twice(1);
  for (int k = 0; k < 8; ++k) camera.Draw(Strip, k == 7);
  twice.DrawPeriods(2, Strip);
  EXPECT_EQ(camera.shown(), twice.shown());
}

// Wherever a square is or was within the period, the picture is shown alone; around it edges stay smooth.
TEST(TemporalFilter, LeavesNoGhostOfWhatMoves) {
  const std::vector<double> exact = Exact(Strip);
  const auto with_square = [](double left) {
    return [left](double x, double y) { return x > left && x < left + 6 && y > 50 && y < 60 ? 250.0 : Strip(x, y); };
  };
  Camera camera(1);
  camera.DrawPeriods(2, Strip);
  for (int k = 0; k < 20; ++k) camera.Draw(with_square(5 + 0.7 * k));
  double error = 0, single = 0;
  int edges = 0;
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const auto k = static_cast<std::size_t>(y * kWidth + x);
      const double shown = Red(camera.shown()[k]);
      if (y >= 49 && y < 61 && x < 35) {
        // The square has passed pixels left of 5 + 0.7 * 11 by more than a pixel within this period.
        if (x < 16) {
          EXPECT_NEAR(shown, 40, 1) << x << " " << y;
        }
      } else if (exact[k] > 40 && exact[k] < 200) {
        error += std::abs(shown - exact[k]);
        single += std::abs(Strip(x + 0.5, y + 0.5) - exact[k]);
        ++edges;
      }
    }
  }
  EXPECT_GT(edges, 100);
  EXPECT_LT(error, single / 3);
}

double Flat(double, double) { return 40; }
/// A bright square of 10 pixels from `left` on, over the flat one.
Scene Square(double left) {
  return [left](double x, double y) { return x > left && x < left + 10 && y > 20 && y < 30 ? 250.0 : 40.0; };
}
/// Pixels that show neither the flat picture nor the square from `left` on, but for its rim, over which a pixel of the
/// picture is interpolated.
int Ghosts(const std::vector<std::uint32_t>& shown, double left) {
  constexpr double kRim = 3;  // [pixels]
  int ghosts = 0;
  for (int k = 0; k < kWidth * kHeight; ++k) {
    const double x = k % kWidth + 0.5, y = k / kWidth + 0.5;
    // How far inside the square.
    const double inside = std::min({x - left, left + 10 - x, y - 20, 30 - y});
    if (std::abs(inside) < kRim) continue;
    const int wanted = inside > 0 ? 250 : 40;
    ghosts += std::abs(Red(shown[static_cast<std::size_t>(k)]) - wanted) > 1 ? 1 : 0;
  }
  return ghosts;
}
constexpr double kNowhere = -1000;

TEST(TemporalFilter, LeavesNoGhostOfWhatIsThereInOnePictureOnly) {
  for (const double scale : {1.0, 0.72}) {
    for (const int first : {0, 3, 5, 200}) {  // In the first period as well.
      Camera camera(scale);
      for (int k = 0; k < first; ++k) camera.Draw(Flat);
      camera.Draw(Square(40));
      EXPECT_EQ(Ghosts(camera.shown(), 40), 0) << scale << ' ' << first;
      for (int k = 0; k < 3 * camera.filter().period(); ++k) {
        camera.Draw(Flat);
        ASSERT_EQ(Ghosts(camera.shown(), kNowhere), 0) << scale << ' ' << first << ' ' << k;
      }
    }
  }
}

TEST(TemporalFilter, LeavesNoGhostOfWhatMovesFast) {
  for (const double scale : {1.0, 0.72}) {
    for (const double speed : {7.0, 20.0}) {  // Less and more than the square in a picture.
      Camera camera(scale);
      camera.DrawPeriods(2, Flat);
      double left = -15;
      for (; left < kWidth; left += speed) {
        camera.Draw(Square(left));
        ASSERT_EQ(Ghosts(camera.shown(), left), 0) << scale << ' ' << speed << ' ' << left;
      }
      for (int k = 0; k < 3 * camera.filter().period(); ++k) {
        camera.Draw(Flat);
        ASSERT_EQ(Ghosts(camera.shown(), kNowhere), 0) << scale << ' ' << speed << ' ' << k;
      }
    }
  }
}

TEST(TemporalFilter, ShowsThePictureAloneUntilThePeriodIsComplete) {
  Camera camera(1);
  camera.DrawPeriods(2, Strip);
  camera.filter().Forget();
  for (int k = 0; k < 7; ++k) {
    camera.Draw([](double, double) { return 90; });
    for (const std::uint32_t pixel : camera.shown()) ASSERT_EQ(pixel, Grey(90)) << k;
  }
}

}  // namespace
}  // namespace fulcrum::render
