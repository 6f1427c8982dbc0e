// Any bytes as one packet to a control socket: read, answered and closed as the supervisor does.
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <optional>
#include <system_error>

#include "services/transport/control/control_socket.h"
#include "tests/fuzz/target.h"

namespace fulcrum::fuzz {
namespace {

using control::Request;

class Connection {
 public:
  explicit Connection(const std::filesystem::path& socket) : fd_(::socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0)) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    std::strncpy(address.sun_path, socket.c_str(), sizeof address.sun_path - 1);
    if (fd_ < 0 || ::connect(fd_, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
      throw std::system_error(errno, std::generic_category(), "connection to the control socket");
    }
  }
  ~Connection() { ::close(fd_); }
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;

  /// False: longer than a packet can be.
  bool Send(Input input) { return ::send(fd_, input.data(), input.size(), MSG_NOSIGNAL) >= 0; }
  /// Bytes received up to the end of the connection; the server has finished by then.
  std::string Receive() {
    std::array<char, control::kMostText_B + 2> answer{};
    const ssize_t got = ::recv(fd_, answer.data(), answer.size(), MSG_DONTWAIT);
    Promise(got >= 0 || errno != EAGAIN, "the connection is neither answered nor closed");
    return {answer.data(), static_cast<std::size_t>(std::max<ssize_t>(got, 0))};
  }

 private:
  int fd_;
};

class Control final : public Target {
 public:
  Outcome Offer(Input input) override {
    std::optional<Request> taken;
    Connection connection(socket_);
    const bool sent = connection.Send(input);
    server_.Serve([&](const Request& request) {
      taken = request;
      return control::Reply{true, request.verb + " " + request.argument};
    });
    if (!sent) return Outcome::kRefused;
    const std::string answer = connection.Receive();
    const std::optional<Request> read = control::RequestFrom(TextOf(input));
    Promise(taken.has_value() == read.has_value(), "the server takes what the parser refuses, or the reverse");
    if (!taken) {
      // An empty packet cannot be distinguished from the end of the connection.
      Promise(answer.empty() == input.empty() && (answer.empty() || answer[0] == '0'), "refused without a reply");
      return Outcome::kRefused;
    }
    const std::vector<char> again = control::PacketOf(*taken);
    Promise(std::equal(again.begin(), again.end(), input.begin(), input.end(),
                       [](char a, std::uint8_t b) { return static_cast<std::uint8_t>(a) == b; }),
            "written differently from how it was read");
    const std::string text = taken->verb + " " + taken->argument;
    Promise(answer == "1" + text.substr(0, control::kMostText_B), "another reply than the handler's");
    return Outcome::kAccepted;
  }
  std::vector<Seed> Seeds() override {
    std::vector<Seed> seeds;
    for (const Request& request :
         {Request{"down", ""}, Request{"restart", "physics_node"}, Request{"generator", "--cut 40 --coag 25"},
          Request{"swap", "render_node --build new"}, Request{"dump", std::string(control::kMostArgument_B, 'x')}}) {
      const std::vector<char> packet = control::PacketOf(request);
      seeds.push_back({request.verb, Bytes(packet.begin(), packet.end())});
    }
    return seeds;
  }

 private:
  const ScratchFolder folder_;
  const std::filesystem::path socket_ = control::SocketOf(folder_.path(), "supervisor");
  control::Server server_{socket_};
};

}  // namespace

std::unique_ptr<Target> MakeControl() { return std::make_unique<Control>(); }

}  // namespace fulcrum::fuzz
