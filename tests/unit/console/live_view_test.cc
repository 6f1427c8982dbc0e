#include "services/session/console/live_view.h"

#include <gtest/gtest.h>

#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "services/base/core/scope.h"
#include "services/transport/bus/in_process.h"

namespace fulcrum::console {
namespace {

constexpr std::int64_t kMs = 1'000'000;

/// A page that reads everything at once, or nothing.
class Page final : public Socket {
 public:
  void SendText(std::string text) override { states.push_back(std::move(text)); }
  bool SendBytes(std::shared_ptr<const std::string> bytes) override {
    if (full) return false;
    pictures.push_back(*bytes);
    return true;
  }
  [[nodiscard]] bool Shows(const std::string& part) const {
    return !states.empty() && states.back().find(part) != std::string::npos;
  }

  std::vector<std::string> states, pictures;
  bool full = false;
};

class LiveViewTest : public testing::Test {
 protected:
  LiveViewTest() { Join(1); }

  void Join(std::uint64_t session) {
    const auto make = [this] {
      ++joined_;
      return LiveView::Ports{pictures_.MakeInput(), hands_.MakeInput(), hands_.MakeOutput()};
    };
    live_.SetSession(make, session);
  }
  void Draw() {
    Picture picture;
    picture.header.stamp = {++drawn_, 3, now_};
    picture.header.width = 960;
    picture.header.height = 540;
    picture.header.eye_W = {0, -0.1f, 0};
    picture.header.up_W = Vec3f::UnitZ();
    picture.header.present = 3;
    picture.header.tip_W[0] = {-0.02f, 0, 0};
    picture.header.tip_W[1] = {0.02f, 0, 0};
    picture.jpeg = {0xff, 0xd8, static_cast<std::uint8_t>(drawn_), 0xff, 0xd9};
    picture.header.size = 5;
    ASSERT_TRUE(picture_out_->Write(picture));
    Turn();
  }
  void Turn() { live_.Turn(now_ += kMs); }
  void Say(Page* page, const std::string& text) { live_.Receive(page, text, now_ += kMs); }
  /// Newest sample that the devices have not read; without a claim if there is none.
  OperatorInput Newest() {
    OperatorInput input;
    while (devices_->TakeNext(&input)) {
    }
    return input;
  }

  bus::InProcessTopic<Picture> pictures_;
  bus::InProcessTopic<OperatorInput> hands_;
  std::unique_ptr<bus::LoanOutput<Picture>> picture_out_ = pictures_.MakeOutput();
  std::unique_ptr<bus::Input<OperatorInput>> devices_ = hands_.MakeInput();
  LiveView live_;
  int joined_ = 0;
  std::uint64_t drawn_ = 0;
  std::int64_t now_ = 1000 * kMs;
};

TEST_F(LiveViewTest, JoinsTheBusForViewersOnly) {
  Draw();
  EXPECT_EQ(joined_, 0);
  EXPECT_FALSE(picture_out_->has_readers()) << "render_node would compress pictures without a viewer";
  Page page;
  live_.Open(&page);
  Turn();
  EXPECT_TRUE(picture_out_->has_readers());
  live_.Close(&page, now_ += kMs);
  EXPECT_FALSE(picture_out_->has_readers());
}

TEST_F(LiveViewTest, ASlowPageGetsFewerPicturesAndTheNewest) {
  Page fast, slow;
  live_.Open(&fast);
  live_.Open(&slow);
  Turn();
  for (int i = 1; i <= 6; ++i) {
    Draw();
    Say(&fast, "seen=" + std::to_string(i));
  }
  EXPECT_EQ(fast.pictures.size(), 6u);
  ASSERT_EQ(slow.pictures.size(), LiveView::kUnseen);
  Say(&slow, "seen=1");
  ASSERT_EQ(slow.pictures.size(), LiveView::kUnseen + 1);
  EXPECT_EQ(slow.pictures.back()[2], 6);
  // A count beyond what was sent does not open the way for more.
  Say(&slow, "seen=1000");
  Draw();
  Draw();
  Draw();
  EXPECT_EQ(slow.pictures.size(), 2 * LiveView::kUnseen + 1);
}

TEST_F(LiveViewTest, OnePageOperatesAndAnotherTakesOver) {
  Page one, two;
  live_.Open(&one);
  live_.Open(&two);
  Turn();
  Say(&one, "take=1");
  EXPECT_TRUE(one.Shows("\"controls\":\"none\"")) << "before the first picture the places of the tools are unknown";
  Draw();
  Say(&one, "x=100&y=0");
  EXPECT_EQ(Newest().claim_ns, 0) << "the controls were not taken";

  Say(&one, "take=1");
  EXPECT_TRUE(one.Shows("\"controls\":\"you\""));
  EXPECT_TRUE(two.Shows("\"controls\":\"browser\""));
  Say(&one, "x=10&down=cut");
  OperatorInput input = Newest();
  EXPECT_EQ(input.source, OperatorSource::kBrowser);
  EXPECT_EQ(input.pedals, kPedalCut);
  EXPECT_TRUE(input.tools[1].moves);
  EXPECT_NEAR(input.tools[1].p_WT.x(), 0.02f + 10 * 1e-3f * 0.1f, 1e-6f) << "a pixel at the tip's depth";

  Say(&two, "x=500&down=coag");
  EXPECT_EQ(Newest().claim_ns, 0) << "no new sample: this page has no controls";
  Say(&two, "take=1");
  input = Newest();
  EXPECT_EQ(input.pedals, kPedalNone) << "the pedal that the first page held";
  EXPECT_TRUE(two.Shows("\"controls\":\"you\""));
  Say(&one, "x=500");
  EXPECT_EQ(Newest().claim_ns, 0);
}

TEST_F(LiveViewTest, APageThatIsClosedReleases) {
  Page page;
  live_.Open(&page);
  Turn();
  Draw();
  Say(&page, "take=1&down=coag");
  EXPECT_EQ(Newest().pedals, kPedalCoag);
  live_.Close(&page, now_ += kMs);
  OperatorInput last;
  bool any = false;
  while (devices_->TakeNext(&last)) any = true;
  EXPECT_TRUE(any);
  EXPECT_EQ(last.claim_ns, 0);
  EXPECT_EQ(last.pedals, kPedalNone);
}

TEST_F(LiveViewTest, AnotherSourceTakesTheControls) {
  Page page;
  live_.Open(&page);
  Turn();
  Draw();
  Say(&page, "take=1");
  EXPECT_TRUE(page.Shows("\"controls\":\"you\""));
  const auto window = hands_.MakeOutput();
  OperatorInput input;
  input.stamp = {1, 77, now_ + kMs};
  input.claim_ns = now_ + kMs;
  input.source = OperatorSource::kWindow;
  ASSERT_TRUE(window->Write(input));
  now_ += kMs;
  Turn();
  EXPECT_TRUE(page.Shows("\"controls\":\"window\""));
  (void)Newest();
  Say(&page, "x=100");
  EXPECT_EQ(Newest().claim_ns, 0) << "the page moves nothing now";
}

TEST_F(LiveViewTest, ToolsKeepTheirRollWhoeverTakesThem) {
  Page page;
  live_.Open(&page);
  Turn();
  Draw();
  Say(&page, "take=1");
  Say(&page, "roll=57.29578");
  EXPECT_NEAR(Newest().tools[1].roll_rad, 1, 1e-5);
  Say(&page, "release=1");
  Say(&page, "take=1");
  EXPECT_NEAR(Newest().tools[1].roll_rad, 1, 1e-5);
  const auto window = hands_.MakeOutput();
  OperatorInput input;
  input.stamp = {1, 77, now_ + kMs};
  input.claim_ns = now_ + kMs;
  input.source = OperatorSource::kWindow;
  input.tools[1] = {Vec3f::Zero(), 0, -0.25f, true};
  ASSERT_TRUE(window->Write(input));
  now_ += kMs;
  Turn();
  (void)Newest();
  Say(&page, "take=1");
  EXPECT_EQ(Newest().tools[1].roll_rad, -0.25f) << "as the window has left it";
}

TEST_F(LiveViewTest, JawsStayClosedWhoeverTakesTheTools) {
  Page page;
  live_.Open(&page);
  Turn();
  Draw();
  Say(&page, "take=1");
  EXPECT_GT(Newest().tools[1].jaw_angle_rad, 0.5f);
  Say(&page, "down=lock");
  Say(&page, "up=lock&release=1");
  (void)Newest();
  Say(&page, "take=1");
  EXPECT_EQ(Newest().tools[1].jaw_angle_rad, 0) << "what it holds does not fall";
  EXPECT_TRUE(page.Shows("\"locked\":true"));
  const auto window = hands_.MakeOutput();
  OperatorInput input;
  input.stamp = {1, 77, now_ + kMs};
  input.claim_ns = now_ + kMs;
  input.source = OperatorSource::kWindow;
  input.tools[0] = {Vec3f::Zero(), 0, 0, true};
  input.tools[1] = {Vec3f::Zero(), 0.7f, 0, true};
  ASSERT_TRUE(window->Write(input));
  now_ += kMs;
  Turn();
  (void)Newest();
  Say(&page, "take=1");
  const OperatorInput taken = Newest();
  EXPECT_EQ(taken.tools[0].jaw_angle_rad, 0) << "the window has closed it";
  EXPECT_GT(taken.tools[1].jaw_angle_rad, 0.5f) << "the window has opened it";
}

TEST_F(LiveViewTest, TheNextSessionBeginsWithoutWhatTheLastOperatorChose) {
  Page page;
  live_.Open(&page);
  Turn();
  Draw();
  Say(&page, "take=1");
  Say(&page, "down=tool0&roll=60");
  Say(&page, "down=steady");
  EXPECT_TRUE(page.Shows("\"tool\":0")) << page.states.back();
  EXPECT_TRUE(page.Shows("\"steady\":true")) << page.states.back();
  live_.SetSession({}, 0);
  Join(1);  // Its supervisor was silent for a while.
  Turn();
  Draw();
  Say(&page, "take=1");
  EXPECT_NEAR(Newest().tools[0].roll_rad, RadiansOf(60), 1e-5);
  live_.SetSession({}, 0);
  Join(2);
  Turn();
  Draw();
  Say(&page, "take=1");
  const OperatorInput input = Newest();
  EXPECT_NE(input.claim_ns, 0);
  EXPECT_EQ(input.tools[0].roll_rad, 0);
  EXPECT_TRUE(page.Shows("\"tool\":1")) << page.states.back();
  EXPECT_TRUE(page.Shows("\"steady\":false")) << page.states.back();
}

TEST_F(LiveViewTest, MalformedMessagesHaveNoEffect) {
  Page page;
  live_.Open(&page);
  Turn();
  Draw();
  Say(&page, "take=1");
  const Vec3f at = Newest().tools[1].p_WT;
  for (const char* text :
       {"x=nan", "x=1e9", "y=", "x=5&x=5", "down=everything", "turn=1000", "seen=-1", "%", "\x01", ""}) {
    Say(&page, text);
  }
  const OperatorInput input = Newest();
  EXPECT_EQ(input.tools[1].p_WT, at);
  EXPECT_EQ(input.pedals, kPedalNone);
}

TEST_F(LiveViewTest, NothingOfASessionStaysAfterItsEnd) {
  Page page;
  live_.Open(&page);
  Turn();
  Draw();
  Say(&page, "take=1");
  live_.SetSession({}, 0);
  EXPECT_TRUE(page.Shows("\"controls\":\"none\""));
  EXPECT_TRUE(page.Shows("\"ready\":false"));
  EXPECT_FALSE(picture_out_->has_readers());
  Say(&page, "take=1&down=cut");
  Turn();
  EXPECT_TRUE(page.Shows("\"controls\":\"none\""));
}

TEST_F(LiveViewTest, ABusThatCannotBeJoinedIsReportedAndTriedAgainInTheNextSession) {
  int tries = 0;
  const auto make = [&]() -> LiveView::Ports {
    ++tries;
    throw std::runtime_error("shared memory is full");
  };
  live_.SetSession(make, 2);
  Page page;
  live_.Open(&page);
  Turn();
  Turn();
  EXPECT_EQ(tries, 1);
  EXPECT_TRUE(page.Shows("\"trouble\":\"shared memory is full\""));
  live_.SetSession({}, 0);
  EXPECT_FALSE(page.Shows("trouble"));
}

}  // namespace
}  // namespace fulcrum::console
