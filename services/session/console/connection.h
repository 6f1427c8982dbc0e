// One client of the HTTP server, over TCP or TLS. Only http_server.cc and connection.cc include this.
#pragma once

#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/ssl/context.hpp>
#include <chrono>
#include <cstdint>
#include <list>
#include <map>
#include <memory>
#include <string>
#include <utility>

#include "services/session/console/admission.h"
#include "services/session/console/http_server.h"
#include "services/session/console/socket.h"

namespace fulcrum::console {

class Connection;

/// Data that all connections share.
struct ServerState {
  ServerState(HttpService given, const HttpLimits& hard)
      : service(std::move(given)), limits(hard), admission(hard.slots) {}

  const HttpService service;
  const HttpLimits limits;
  Admission admission;
  std::map<Admission::Id, std::weak_ptr<Connection>> open;
  std::list<std::weak_ptr<Connection>> streams;
  std::size_t sockets = 0;  ///< Connections that are WebSockets.

  void Close(Admission::Id connection);
};

class Connection {
 public:
  Connection(Admission::Id id, std::shared_ptr<ServerState> server) : id_(id), server_(std::move(server)) {}
  virtual ~Connection() = default;
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;

  /// Begins to serve; the connection keeps itself alive until it is closed.
  virtual void Begin() = 0;
  void Close();
  [[nodiscard]] bool open() const { return open_; }

  // For a connection that has become a stream:
  virtual void SendPart(std::string text) = 0;
  [[nodiscard]] bool busy() const { return busy_; }
  [[nodiscard]] bool is_late(std::chrono::steady_clock::time_point now) const {
    return busy_ && now - busy_since_ > server_->limits.response;
  }
  std::uint64_t* cursor() { return &cursor_; }

 protected:
  virtual void CloseSocket() = 0;
  void BeginPart() {
    busy_ = true;
    busy_since_ = std::chrono::steady_clock::now();
  }
  void EndPart() { busy_ = false; }

  [[nodiscard]] ServerState& server() { return *server_; }
  [[nodiscard]] Admission::Id id() const { return id_; }

 private:
  const Admission::Id id_;
  const std::shared_ptr<ServerState> server_;
  bool open_ = true;
  bool busy_ = false;  ///< A part of a stream is being sent.
  std::chrono::steady_clock::time_point busy_since_;
  std::uint64_t cursor_ = 0;
};

/// @param tls null: plain TCP.
[[nodiscard]] std::shared_ptr<Connection> MakeConnection(boost::asio::ip::tcp::socket socket, Admission::Id id,
                                                         std::shared_ptr<ServerState> server,
                                                         boost::asio::ssl::context* tls);

}  // namespace fulcrum::console
