// A WebSocket of a client as the console sees it, and what the server tells about it. All on the server's thread.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <string_view>

namespace fulcrum::console {

class Socket {
 public:
  virtual ~Socket() = default;
  /// Sends a text after those before it. A client that leaves too many unread is closed.
  virtual void SendText(std::string text) = 0;
  /// Sends bytes unless earlier ones are still on their way: then false.
  virtual bool SendBytes(std::shared_ptr<const std::string> bytes) = 0;
};

struct SocketService {
  std::function<void(Socket*)> opened = [](Socket*) {};
  std::function<void(Socket*, std::string_view)> received = [](Socket*, std::string_view) {};
  std::function<void(Socket*)> closed = [](Socket*) {};  ///< Its last call; follows `opened` always.
};

}  // namespace fulcrum::console
