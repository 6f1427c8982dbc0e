#include "services/session/supervisor/domain_guard.h"

#include <grp.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <functional>
#include <memory>
#include <string>

#include "services/base/core/error.h"

namespace fulcrum::supervisor {
namespace {

constexpr int kDomain = 99;
constexpr uid_t kStranger = 65534;  // nobody

/// Exit code of `body` in a child process that runs as another user.
int AsStranger(const std::function<int()>& body) {
  const pid_t child = ::fork();
  if (child == 0) {
    const bool other = ::setgroups(0, nullptr) == 0 && ::setresgid(kStranger, kStranger, kStranger) == 0 &&
                       ::setresuid(kStranger, kStranger, kStranger) == 0;
    ::_exit(other ? body() : 99);
  }
  int status = 0;
  ::waitpid(child, &status, 0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

std::string Refusal(int domain) {
  try {
    const DomainGuard guard(domain);
    return {};
  } catch (const InputError& error) {
    return error.what();
  }
}

TEST(DomainGuard, OneHolderAtATime) {
  EXPECT_FALSE(DomainGuard::IsHeld(kDomain));
  EXPECT_FALSE(DomainGuard::Holder(kDomain));
  {
    const DomainGuard guard(kDomain);
    EXPECT_TRUE(DomainGuard::IsHeld(kDomain));
    EXPECT_EQ(DomainGuard::Holder(kDomain)->pid, ::getpid());
    const std::string refusal = Refusal(kDomain);
    EXPECT_NE(refusal.find("a session runs in domain 99 (pid " + std::to_string(::getpid()) + ")"), std::string::npos)
        << refusal;
  }
  EXPECT_FALSE(DomainGuard::IsHeld(kDomain));
  EXPECT_EQ(Refusal(kDomain), "");
}

// A session that is ending accepts no connection, and each look at it is one.
TEST(DomainGuard, IsHeldHoweverOftenItIsLookedAt) {
  {
    const DomainGuard guard(kDomain);
    for (int i = 0; i < 100; ++i) {
      ASSERT_TRUE(DomainGuard::IsHeld(kDomain)) << i;
      ASSERT_TRUE(DomainGuard::IsTaken(kDomain)) << i;
    }
  }
  EXPECT_FALSE(DomainGuard::IsTaken(kDomain));
}

// Two users' sessions in one domain would mix on the loopback.
TEST(DomainGuard, AnotherUsersSessionIsRefusedByName) {
  if (::getuid() != 0) GTEST_SKIP() << "only root can become another user";
  const DomainGuard guard(kDomain);
  EXPECT_EQ(AsStranger([] {
              const std::string refusal = Refusal(kDomain);
              const bool named = refusal.find("another user's session runs in domain 99") == 0 &&
                                 refusal.find("uid 0, pid ") != std::string::npos &&
                                 refusal.find("host ") != std::string::npos;
              if (!named) std::fprintf(stderr, "%s\n", refusal.c_str());
              const std::string line = DomainGuard::OtherUsers(kDomain);
              const bool told = line.find("(root, uid 0, pid ") != std::string::npos &&
                                line.find("sudo -u root fulcrum status --domain 99") != std::string::npos;
              if (!told) std::fprintf(stderr, "%s\n", line.c_str());
              return named && told && !DomainGuard::IsHeld(kDomain) && DomainGuard::IsTaken(kDomain) ? 7 : 1;
            }),
            7);
  EXPECT_EQ(DomainGuard::OtherUsers(kDomain), "") << "its own user's";
}

}  // namespace
}  // namespace fulcrum::supervisor
