#include "services/transport/control/control_socket.h"

#include <grp.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cstring>
#include <functional>
#include <future>
#include <thread>

#include "services/base/core/error.h"

namespace fulcrum::control {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;

constexpr uid_t kStranger = 65534;  // nobody

class ControlSocket : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::temp_directory_path() / ("control_test." + std::to_string(::getpid()));
    fs::create_directory(folder_);
    socket_ = SocketOf(folder_, "supervisor");
  }
  void TearDown() override { fs::remove_all(folder_); }

  /// Serves until `done`, and returns its result.
  template <class Result>
  static Result ServeUntil(Server* server, std::future<Result> done, const Server::Handler& handle) {
    while (done.wait_for(1ms) != std::future_status::ready) server->Serve(handle);
    return done.get();
  }
  /// Exit code of `body` in a child process that runs as another user.
  static int AsStranger(const std::function<int()>& body, Server* server, const Server::Handler& handle) {
    const pid_t child = ::fork();
    if (child == 0)
      ::_exit(::setgroups(0, nullptr) == 0 && ::setresgid(kStranger, kStranger, kStranger) == 0 &&
                      ::setresuid(kStranger, kStranger, kStranger) == 0
                  ? body()
                  : 99);
    int status = 0;
    while (::waitpid(child, &status, WNOHANG) == 0) {
      server->Serve(handle);
      std::this_thread::sleep_for(1ms);
    }
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  }
  static int ConnectAbstract(const std::string& name, bool listens) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    std::memcpy(address.sun_path + 1, name.data(), name.size());
    const auto length = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + 1 + name.size());
    const int fd = ::socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
    const auto* at = reinterpret_cast<const sockaddr*>(&address);
    const bool good = listens ? ::bind(fd, at, length) == 0 && ::listen(fd, 8) == 0 : ::connect(fd, at, length) == 0;
    return good ? fd : -1;
  }

  fs::path folder_, socket_;
};

TEST_F(ControlSocket, AServerMaySleepUntilARequestArrives) {
  Server server(socket_);
  const auto descriptors = [&server] {
    std::vector<int> all;
    server.AddDescriptors(&all);
    return all;
  };
  const auto begin = std::chrono::steady_clock::now();
  AwaitInput(descriptors(), 30ms);
  EXPECT_GE(std::chrono::steady_clock::now() - begin, 30ms) << "no request has arrived";
  std::future<Reply> reply = std::async(std::launch::async, [&] { return Ask(socket_, {"down", ""}); });
  // First the connection, then the request over it.
  for (int turn = 0; turn < 20 && reply.wait_for(0s) != std::future_status::ready; ++turn) {
    AwaitInput(descriptors(), 5s);
    server.Serve([](const Request& request) { return Reply{true, request.verb}; });
    if (descriptors().size() == 1) reply.wait_for(1s);
  }
  ASSERT_EQ(reply.wait_for(5s), std::future_status::ready);
  EXPECT_EQ(reply.get().text, "down");
  EXPECT_LT(std::chrono::steady_clock::now() - begin, 5s);
}

TEST_F(ControlSocket, CarriesARequestAndItsReply) {
  Server server(socket_);
  struct stat status {};
  ASSERT_EQ(::stat(socket_.c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 0777u, 0600u);
  ASSERT_EQ(::stat(socket_.parent_path().c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 0777u, 0700u);
  Request heard;
  const Reply reply = ServeUntil(&server,
                                 std::async(std::launch::async,
                                            [&] {
                                              return Ask(socket_, {"swap", std::string("node\nbuild\0x", 12)});
                                            }),
                                 [&](const Request& request) {
                                   heard = request;
                                   return Reply{false, "no such build"};
                                 });
  EXPECT_EQ(heard.verb, "swap");
  EXPECT_EQ(heard.argument, std::string("node\nbuild\0x", 12));
  EXPECT_FALSE(reply.ok);
  EXPECT_EQ(reply.text, "no such build");
}

TEST_F(ControlSocket, AHandlerThatThrowsRefuses) {
  Server server(socket_);
  const Reply reply = ServeUntil(&server,
                                 std::async(std::launch::async,
                                            [&] {
                                              return Ask(socket_, {"dump", ""});
                                            }),
                                 [](const Request&) -> Reply { throw InputError("nothing is kept"); });
  EXPECT_FALSE(reply.ok);
  EXPECT_EQ(reply.text, "nothing is kept");
}

TEST_F(ControlSocket, TellWaitsForNobody) {
  EXPECT_FALSE(Tell(socket_, {"stop", ""}));
  Server server(socket_);
  EXPECT_TRUE(Tell(socket_, {"stop", "now"}));
  std::string heard;
  server.Serve([&](const Request& request) {
    heard = request.verb + " " + request.argument;
    return Reply{};
  });
  EXPECT_EQ(heard, "stop now");
}

TEST_F(ControlSocket, WithoutAServerTheClientSaysWhere) {
  try {
    (void)Ask(socket_, {"down", ""});
    FAIL();
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find(socket_.string() + ": no process listens"), std::string::npos)
        << error.what();
  }
}

TEST_F(ControlSocket, ReplacesTheSocketOfADeadProcess) {
  { Server first(socket_); }
  const Server second(socket_);
  const Server third(socket_);  // A socket file left over from a killed server looks the same.
  EXPECT_TRUE(fs::is_socket(socket_));
}

TEST_F(ControlSocket, PacketsThatAreNoRequestAreRefused) {
  EXPECT_FALSE(RequestFrom(""));
  EXPECT_FALSE(RequestFrom("down"));
  EXPECT_FALSE(RequestFrom(std::string("\0down", 5)));
  EXPECT_FALSE(RequestFrom(std::string(kMostVerb_B + 1, 'x') + '\0'));
  EXPECT_FALSE(RequestFrom(std::string("do wn\0", 6)));
  EXPECT_FALSE(RequestFrom(std::string("down\0", 5) + std::string(kMostArgument_B + 1, 'x')));
  EXPECT_THROW((void)PacketOf({"", ""}), InputError);
  EXPECT_THROW((void)PacketOf({"down", std::string(kMostArgument_B + 1, 'x')}), InputError);
  const auto request = RequestFrom({PacketOf({"down", "now"}).data(), 8});
  ASSERT_TRUE(request);
  EXPECT_EQ(request->verb, "down");
  EXPECT_EQ(request->argument, "now");
}

TEST_F(ControlSocket, SilentClientsDoNotKeepOthersOut) {
  Server server(socket_);
  const sockaddr_un address = [&] {
    sockaddr_un made{};
    made.sun_family = AF_UNIX;
    std::strncpy(made.sun_path, socket_.c_str(), sizeof made.sun_path - 1);
    return made;
  }();
  std::vector<int> silent;
  for (int i = 0; i < 40; ++i) {
    silent.push_back(::socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
    (void)::connect(silent.back(), reinterpret_cast<const sockaddr*>(&address), sizeof address);
    server.Serve([](const Request&) { return Reply{}; });
  }
  const Reply reply = ServeUntil(&server,
                                 std::async(std::launch::async,
                                            [&] {
                                              return Ask(socket_, {"down", ""});
                                            }),
                                 [](const Request&) {
                                   return Reply{true, "ending"};
                                 });
  EXPECT_EQ(reply.text, "ending");
  for (const int fd : silent) ::close(fd);
}

TEST_F(ControlSocket, AnotherUserReachesNoSocketOfTheDirectory) {
  if (::getuid() != 0) GTEST_SKIP() << "only root can become another user";
  fs::permissions(folder_, fs::perms::owner_all);
  Server server(socket_);
  bool handled = false;
  const int code = AsStranger(
      [&] {
        try {
          (void)Ask(socket_, {"down", ""}, 1);
          return 0;
        } catch (const InputError&) {
          return 7;
        }
      },
      &server,
      [&](const Request&) {
        handled = true;
        return Reply{};
      });
  EXPECT_EQ(code, 7);
  EXPECT_FALSE(handled);
}

TEST_F(ControlSocket, OnAnOpenSocketTheKernelNamesTheCaller) {
  if (::getuid() != 0) GTEST_SKIP() << "only root can become another user";
  const std::string name = folder_.string();
  const int listening = ConnectAbstract(name, true);
  ASSERT_GE(listening, 0);
  const auto knock = [&] {
    const int fd = ConnectAbstract(name, false);
    if (fd < 0) return 8;
    try {
      const Reply reply = Ask(fd, {"down", ""}, 2);
      return reply.ok ? 0 : reply.text == kNotAdmitted ? 7 : 9;
    } catch (const std::exception& error) {
      std::fprintf(stderr, "%s\n", error.what());
      return 10;
    }
  };
  int handled = 0;
  const auto handle = [&](const Request&) {
    ++handled;
    return Reply{true, "ending"};
  };
  {
    Server server(listening, std::nullopt);
    EXPECT_EQ(AsStranger(knock, &server, handle), 7);
    EXPECT_EQ(server.refused(), 1u);
    EXPECT_EQ(handled, 0);
  }
  Server server(listening, gid_t{kStranger});
  EXPECT_EQ(AsStranger(knock, &server, handle), 0) << "a member of the group";
  EXPECT_EQ(handled, 1);
  ::close(listening);
}

}  // namespace
}  // namespace fulcrum::control
