// Recordings of attempts as films in the page: pictures of any time, drawn anew by a replayer for each film.
//
// From the page, one form per message (form.h): first `session`, then `t` (session time [s]) again and again, each
// after the answer to the last. To the page, as JSON: `end` (session time of the end [s]), then for each `t` the
// picture as a JPEG file, unless it is that of the time before, and after it `t`; or `trouble` (why there are no
// pictures).
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <string_view>

#include "services/session/console/form.h"
#include "services/session/console/socket.h"

namespace fulcrum::console {

class AttemptFilms {
 public:
  static constexpr std::size_t kMost = 4;  ///< Films at a time, of all pages: each is a process that draws.

  /// Folder of a session; empty: it may not be seen.
  using FolderOf = std::function<std::filesystem::path(const std::string& session)>;
  /// Calls a function on the thread of all other calls. From any thread.
  using Post = std::function<void(std::function<void()>)>;

  /// @param replayer path of the program.
  AttemptFilms(std::filesystem::path replayer, FolderOf folder_of, Post post);
  ~AttemptFilms();
  AttemptFilms(const AttemptFilms&) = delete;
  AttemptFilms& operator=(const AttemptFilms&) = delete;

  /// Ends all films. Call before what `post` uses ends.
  void End();

  /// Ends all films and tells their pages why.
  void Stop(const std::string& why);

  void Open(Socket* page);
  void Close(Socket* page);
  /// A message that is malformed has no effect. Call from the main thread, because the process ends with it.
  void Receive(Socket* page, std::string_view text);

 private:
  class Projector;

  void Begin(Socket* page, const std::string& session);
  /// What the projector of number `number` has sent.
  void Show(std::uint64_t number, const std::string& line, const std::shared_ptr<const std::string>& jpeg);

  const std::filesystem::path replayer_;
  const FolderOf folder_of_;
  const Post post_;
  std::map<Socket*, std::unique_ptr<Projector>> films_;  ///< Null: no session was named yet.
  std::uint64_t begun_ = 0;
};

}  // namespace fulcrum::console
