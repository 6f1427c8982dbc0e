#include "services/session/console/live_view.h"

#include <array>
#include <exception>
#include <utility>

#include "services/base/core/scope.h"
#include "services/session/console/json.h"

namespace fulcrum::console {
namespace {

struct NamedKey {
  std::string_view name;
  HandsKey key;
};
constexpr std::array kKeys{
    NamedKey{"tool0", HandsKey::kTool0},   NamedKey{"tool1", HandsKey::kTool1}, NamedKey{"jaw", HandsKey::kJaw},
    NamedKey{"lock", HandsKey::kJawLock},  NamedKey{"cut", HandsKey::kCut},     NamedKey{"coag", HandsKey::kCoag},
    NamedKey{"clutch", HandsKey::kClutch}, NamedKey{"depth", HandsKey::kDepth}, NamedKey{"fine", HandsKey::kFine},
    NamedKey{"steady", HandsKey::kSteady}, NamedKey{"tool2", HandsKey::kTool2}, NamedKey{"tool3", HandsKey::kTool3},
};
/// Longest motion of the pointer in one message [pixels], most steps of depth, and widest turn [degrees].
constexpr double kLongestMove = 4000, kMostSteps = 50, kWidestTurn = 90;

std::optional<double> NumberOf(const Form& form, std::string_view name, double least, double most) {
  const auto found = form.find(name);
  return found == form.end() ? std::nullopt : ParseNumber(found->second, least, most);
}

void PressNamed(const Form& form, std::string_view field, bool down, MouseHands* hands) {
  const auto found = form.find(field);
  if (found == form.end()) return;
  for (const NamedKey& one : kKeys) {
    if (one.name == found->second) hands->Press(one.key, down);
  }
}

HandsView ViewOf(const PictureHeader& header, const std::array<OperatorTool, kMaxTools>& operated) {
  HandsView view;
  view.eye = header.eye_W;
  view.right = header.right_W;
  view.up = header.up_W;
  view.forward = header.forward_W;
  view.pixel = header.pixel_rad;
  view.tip = header.tip_W;
  for (std::size_t i = 0; i < kMaxTools; ++i) {
    view.present[i] = (header.present >> i & 1u) != 0;
    view.scope[i] = (header.scopes >> i & 1u) != 0;
    if (!operated[i].moves) continue;
    view.roll_rad[i] = operated[i].roll_rad;
    view.closed[i] = IsClosed(operated[i].jaw_angle_rad, view.scope[i]);
  }
  return view;
}

const char* NameOf(OperatorSource source) {
  switch (source) {
    case OperatorSource::kWindow:
      return "window";
    case OperatorSource::kProgram:
      return "program";
    case OperatorSource::kBrowser:
      return "browser";
    case OperatorSource::kNone:
      break;
  }
  return "none";
}

}  // namespace

void LiveView::SetSession(MakePorts make, std::uint64_t session) {
  make_ = std::move(make);
  ports_ = {};
  trouble_.clear();
  holder_ = nullptr;
  other_ = OperatorSource::kNone;
  hands_.Release();
  if (session != 0 && session != session_) {
    // Nothing of the last session's operator remains.
    hands_ = MouseHands(OperatorSource::kBrowser);
    operated_ = {};
    session_ = session;
  }
  choice_ = {};
  picture_ = {};
  jpeg_.reset();
  for (auto& [socket, viewer] : viewers_) viewer.newest = 0;
  SendStates();
}

void LiveView::Open(Socket* viewer) {
  viewers_[viewer];
  SendStates();
}

void LiveView::Close(Socket* viewer, std::int64_t now_ns) {
  if (holder_ == viewer) Release(now_ns);
  viewers_.erase(viewer);
  // Without a viewer render_node compresses no pictures.
  if (viewers_.empty()) ports_ = {};
}

void LiveView::Release(std::int64_t now_ns) {
  if (holder_ == nullptr) return;
  holder_ = nullptr;
  hands_.Release();
  Write(now_ns);
  SendStates();
}

void LiveView::Receive(Socket* viewer, std::string_view text, std::int64_t now_ns) {
  const auto found = viewers_.find(viewer);
  const std::optional<Form> form = ParseForm(text);
  if (found == viewers_.end() || !form) return;
  if (const auto seen = NumberOf(*form, "seen", 0, 1e15)) {
    found->second.seen = std::min(static_cast<std::uint64_t>(*seen), found->second.sent);
    SendPicture(viewer, &found->second);
  }
  if (form->contains("take") && ports_.hands && picture_.header.stamp.sequence != 0) {
    hands_.Release();  // Keys that another page holds end with its controls.
    hands_.SetView(ViewOf(picture_.header, operated_));
    hands_.Take(now_ns);
    holder_ = viewer;
  }
  if (holder_ != viewer) return SendStates();
  if (form->contains("release")) return Release(now_ns);
  Apply(*form, now_ns);
  SendStates();
}

void LiveView::Apply(const Form& form, std::int64_t now_ns) {
  hands_.SetView(ViewOf(picture_.header, operated_));
  PressNamed(form, "down", true, &hands_);
  const double x = NumberOf(form, "x", -kLongestMove, kLongestMove).value_or(0);
  const double y = NumberOf(form, "y", -kLongestMove, kLongestMove).value_or(0);
  if (x != 0 || y != 0) hands_.Move(static_cast<float>(x), static_cast<float>(y));
  if (const auto turn = NumberOf(form, "turn", -kMostSteps, kMostSteps)) hands_.Turn(static_cast<int>(*turn));
  if (const auto roll = NumberOf(form, "roll", -kWidestTurn, kWidestTurn)) {
    hands_.Roll(RadiansOf(static_cast<float>(*roll)));
  }
  PressNamed(form, "up", false, &hands_);
  Write(now_ns);
}

void LiveView::NoteTools(const OperatorInput& input) {
  for (std::size_t i = 0; i < kMaxTools; ++i) {
    if (input.tools[i].moves) operated_[i] = input.tools[i];
  }
}

void LiveView::Write(std::int64_t now_ns) {
  if (!ports_.hands) return;
  input_ = hands_.At(now_ns);
  input_.stamp = stamper_->Next(now_ns);
  epoch_ = input_.stamp.epoch;
  NoteTools(input_);
  (void)ports_.hands->Write(input_);
}

void LiveView::Turn(std::int64_t now_ns) {
  if (make_ && !viewers_.empty() && !ports_.pictures) {
    try {
      ports_ = make_();
    } catch (const std::exception& error) {
      trouble_ = error.what();
      make_ = {};
      return SendStates();
    }
    stamper_ = std::make_unique<bus::Stamper>(now_ns);
  }
  if (!ports_.pictures) return;
  ReadOthers(now_ns);
  if (ports_.pictures->TakeLatest(&picture_)) {
    jpeg_ = std::make_shared<const std::string>(picture_.jpeg.begin(), picture_.jpeg.end());
  }
  for (auto& [socket, viewer] : viewers_) SendPicture(socket, &viewer);
  SendStates();
}

void LiveView::ReadOthers(std::int64_t now_ns) {
  OperatorInput received;
  while (ports_.others->TakeNext(&received)) {
    if (choice_.Add(received)) NoteTools(received);
  }
  const OperatorInput* const now = choice_.At(now_ns);
  const bool own = now == nullptr || (now->source == OperatorSource::kBrowser && now->stamp.epoch == epoch_);
  other_ = own ? OperatorSource::kNone : now->source;
  // Another source has taken the controls since.
  if (!own && holder_ != nullptr && now->claim_ns > input_.claim_ns) {
    holder_ = nullptr;
    hands_.Release();
  }
}

void LiveView::SendPicture(Socket* socket, Viewer* viewer) {
  const std::uint64_t sequence = picture_.header.stamp.sequence;
  if (!jpeg_ || viewer->newest == sequence || viewer->sent - viewer->seen >= kUnseen) return;
  if (!socket->SendBytes(jpeg_)) return;
  viewer->newest = sequence;
  ++viewer->sent;
}

void LiveView::SendStates() {
  for (auto& [socket, viewer] : viewers_) {
    std::string state = StateFor(socket);
    if (state == viewer.state) continue;
    viewer.state = state;
    socket->SendText(std::move(state));
  }
}

std::string LiveView::StateFor(const Socket* viewer) const {
  const char* const controls = holder_ == viewer && holder_ != nullptr ? "you"
                               : holder_ != nullptr                    ? "browser"
                                                                       : NameOf(other_);
  Json json('{');
  json.Text("controls", controls).Flag("ready", ports_.hands && picture_.header.stamp.sequence != 0);
  json.Number("tool", hands_.tool(), 1).Flag("locked", hands_.locked(hands_.tool())).Flag("steady", hands_.steady());
  json.Number("present", picture_.header.present, 1);
  json.Flag("scope", (picture_.header.scopes >> hands_.tool() & 1u) != 0);
  if (!trouble_.empty()) json.Text("trouble", trouble_);
  return json.Done();
}

}  // namespace fulcrum::console
