// The live picture in browsers, and browsers as the operator's hands: pictures of the topic Picture go to every viewer,
// and what the one viewer with the controls does becomes OperatorInput.
//
// From the page, one form per message (form.h): `take`, `release`; `x`, `y` (motion of the pointer [pixels of the
// picture], y up); `turn` (steps of depth); `down`, `up` (a key's name); `seen` (number of pictures drawn so far). To
// the page: pictures as JPEG files, and the state of the controls as JSON.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <string_view>

#include "services/base/core/mouse_hands.h"
#include "services/base/core/operator_choice.h"
#include "services/session/console/form.h"
#include "services/session/console/socket.h"
#include "services/transport/bus/input_account.h"
#include "services/transport/bus/port.h"

namespace fulcrum::console {

class LiveView {
 public:
  /// Pictures that may be on their way to a viewer: with more, an old picture would wait in a socket.
  static constexpr std::uint64_t kUnseen = 2;

  struct Ports {
    std::unique_ptr<bus::Input<Picture>> pictures;
    std::unique_ptr<bus::Input<OperatorInput>> others;  ///< What every source does, this one included.
    std::unique_ptr<bus::Output<OperatorInput>> hands;
  };

  /// Makes the ports of the running session; called when the first viewer is there. What it throws is shown to the
  /// viewers, and the session has no live picture.
  using MakePorts = std::function<Ports()>;

  /// A session has begun, or ended (empty, 0). @param session its number: in one that is joined again the tools are
  /// still turned, and their jaws closed, as its operators have left them.
  void SetSession(MakePorts make, std::uint64_t session);

  void Open(Socket* viewer);
  void Close(Socket* viewer, std::int64_t now_ns);
  /// A message of a viewer that is malformed has no effect.
  void Receive(Socket* viewer, std::string_view text, std::int64_t now_ns);

  /// Forwards what has arrived on the bus. Call at each arrival of a picture, and a few times a second.
  void Turn(std::int64_t now_ns);

 private:
  struct Viewer {
    std::uint64_t sent = 0, seen = 0;  ///< Pictures.
    std::uint64_t newest = 0;          ///< Sequence of the last picture that was sent.
    std::string state;                 ///< Last state that was sent.
  };

  void Apply(const Form& form, std::int64_t now_ns);
  void NoteTools(const OperatorInput& input);
  void Write(std::int64_t now_ns);
  void ReadOthers(std::int64_t now_ns);
  void SendPicture(Socket* socket, Viewer* viewer);
  void SendStates();
  [[nodiscard]] std::string StateFor(const Socket* viewer) const;
  /// Releases the controls if a viewer has them.
  void Release(std::int64_t now_ns);

  MakePorts make_;
  std::uint64_t session_ = 0;  ///< The newest.
  std::string trouble_;        ///< Why the ports could not be made.
  Ports ports_;
  std::map<Socket*, Viewer> viewers_;
  Socket* holder_ = nullptr;  ///< The viewer with the controls.
  OperatorSource other_ = OperatorSource::kNone;
  MouseHands hands_{OperatorSource::kBrowser};
  std::array<OperatorTool, kMaxTools> operated_{};  ///< What an operator has done with each tool last.
  std::unique_ptr<bus::Stamper> stamper_;
  std::uint64_t epoch_ = 0;
  OperatorChoice choice_;
  OperatorInput input_;
  Picture picture_;
  std::shared_ptr<const std::string> jpeg_;
};

}  // namespace fulcrum::console
