// Protection of the console against strangers: admission of connections, the certificate, the printed token.
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <algorithm>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <set>
#include <string>

#include "services/base/core/error.h"
#include "services/session/console/admission.h"
#include "services/session/console/greeting.h"
#include "services/session/console/http_server.h"
#include "services/session/console/router.h"
#include "services/session/console/tls_identity.h"

namespace fulcrum::console {
namespace {

namespace fs = std::filesystem;
using std::chrono::milliseconds;

constexpr Admission::Limits kSmall{.guests = 3, .guests_per_address = 2, .known = 1, .stay = milliseconds(20)};
constexpr Admission::Time kStart{std::chrono::seconds(100)};

TEST(Admission, TheOldestOfTheSameAddressGivesWayFirst) {
  Admission admission(kSmall);
  EXPECT_FALSE(admission.Enter(1, "other", kStart));
  EXPECT_FALSE(admission.Enter(2, "same", kStart));
  EXPECT_FALSE(admission.Enter(3, "same", kStart));
  EXPECT_EQ(admission.Enter(4, "same", kStart), 2u);
  EXPECT_EQ(admission.Enter(5, "third", kStart), 1u);
  EXPECT_EQ(admission.guests(), 3u);
}

TEST(Admission, AGuestStaysForAMoment) {
  Admission admission(kSmall);
  EXPECT_EQ(admission.Earliest("a", kStart), kStart);
  (void)admission.Enter(1, "a", kStart);
  (void)admission.Enter(2, "a", kStart + milliseconds(5));
  EXPECT_EQ(admission.Earliest("a", kStart + milliseconds(6)), kStart + milliseconds(20));
  EXPECT_EQ(admission.Earliest("a", kStart + milliseconds(30)), kStart + milliseconds(30));
  EXPECT_EQ(admission.Earliest("b", kStart + milliseconds(6)), kStart + milliseconds(6));
}

TEST(Admission, GuestsNeverTakeAReservedSlot) {
  Admission admission(kSmall);
  (void)admission.Enter(1, "a", kStart);
  EXPECT_TRUE(admission.Recognise(1));
  for (Admission::Id id = 2; id < 1000; ++id) {
    EXPECT_NE(admission.Enter(id, std::to_string(id % 7), kStart), 1u);
    EXPECT_LE(admission.guests(), kSmall.guests);
  }
  EXPECT_EQ(admission.known(), 1u);
  EXPECT_FALSE(admission.Recognise(999)) << "all reserved slots are taken";
  admission.Leave(1);
  EXPECT_TRUE(admission.Recognise(999));
  EXPECT_EQ(admission.guests() + admission.known(), 3u);
}

TEST(Admission, WhoLeavesFreesItsSlot) {
  Admission admission(kSmall);
  for (Admission::Id id = 1; id <= 2; ++id) (void)admission.Enter(id, "a", kStart);
  admission.Leave(1);
  EXPECT_FALSE(admission.Enter(3, "a", kStart));
  EXPECT_EQ(admission.TakeOldest(), 2u);
  EXPECT_EQ(admission.TakeOldest(), 3u);
  EXPECT_FALSE(admission.TakeOldest());
}

TEST(HttpServer, OnlyLoopbackNeedsNoTls) {
  for (const char* own : {"127.0.0.1", "127.3.2.1", "::1"}) EXPECT_TRUE(IsLoopback(own)) << own;
  for (const char* open : {"0.0.0.0", "::", "192.168.0.7", "::ffff:127.0.0.1"}) EXPECT_FALSE(IsLoopback(open)) << open;
  EXPECT_THROW((void)IsLoopback("localhost"), InputError);
}

TEST(Router, APageOverTlsIsOfTheSameSiteOverTlsOnly) {
  const std::string token(64, 'a');
  HttpRequest request;
  request.method = "POST";
  request.target = "/api/stop";
  request.host = "cart:8480";
  request.authorization = "Bearer " + token;
  request.secure = true;
  const auto accepted = [&] { return Route(Access(token, {"cart"}), request).routed.has_value(); };
  request.origin = "https://cart:8480";
  EXPECT_TRUE(accepted());
  request.origin = "http://cart:8480";
  EXPECT_FALSE(accepted());
  request.secure = false;
  EXPECT_TRUE(accepted());
}

class TlsFolder : public ::testing::Test {
 protected:
  void SetUp() override {
    std::string name = (fs::temp_directory_path() / "fulcrum_tls_XXXXXX").string();
    ASSERT_NE(::mkdtemp(name.data()), nullptr);
    folder_ = name;
  }
  void TearDown() override { fs::remove_all(folder_); }
  TlsIdentity Load(std::time_t now = 1'800'000'000) {
    return LoadTlsIdentity(folder_, {"cart-3", "10.0.0.1"}, now, &made_);
  }

  fs::path folder_;
  bool made_ = false;
};

TEST_F(TlsFolder, KeepsItsIdentityUntilItEnds) {
  const TlsIdentity first = Load();
  EXPECT_TRUE(made_);
  EXPECT_EQ(first.fingerprint.size(), 32 * 3 - 1);
  for (const char* name : {"console.pem", "console.key"}) {
    struct stat status {};
    ASSERT_EQ(::stat((folder_ / name).c_str(), &status), 0);
    EXPECT_EQ(status.st_mode & 0777u, 0600u) << name;
  }
  const TlsIdentity second = Load();
  EXPECT_FALSE(made_);
  EXPECT_EQ(second.fingerprint, first.fingerprint);
  EXPECT_EQ(second.until, first.until);
  const TlsIdentity renewed = Load(first.until - 24 * 3600);
  EXPECT_TRUE(made_);
  EXPECT_NE(renewed.fingerprint, first.fingerprint);
}

TEST_F(TlsFolder, AnIdentityMadeWhileTheClockWasAheadIsRenewed) {
  constexpr std::time_t kToday = 1'800'000'000, kDay = 24 * 3600;
  const TlsIdentity ahead = Load(kToday + 400 * kDay);
  const TlsIdentity renewed = Load(kToday);
  EXPECT_TRUE(made_);
  EXPECT_NE(renewed.fingerprint, ahead.fingerprint);
  EXPECT_LT(renewed.from, kToday);
  (void)Load(kToday);
  EXPECT_FALSE(made_);
}

TEST_F(TlsFolder, FilesThatCannotBeTrustedAreRefused) {
  (void)Load();
  ::chmod((folder_ / "console.key").c_str(), 0644);
  EXPECT_THROW((void)Load(), InputError) << "others can read the key";
  ::chmod((folder_ / "console.key").c_str(), 0600);
  std::ofstream(folder_ / "console.key") << MakeTlsIdentity({}, 1'800'000'000).key;
  EXPECT_THROW((void)Load(), InputError) << "the key of another certificate";
  std::ofstream(folder_ / "console.pem") << "nothing\n";
  EXPECT_THROW((void)Load(), InputError);
  std::ofstream(folder_ / "console.pem") << std::string(100'000, 'x');
  EXPECT_THROW((void)Load(), InputError);
}

TEST(TlsIdentity, NamesThatMeanSomethingToOpensslAreLeftOut) {
  // "DNS:a,IP:1.2.3.4" as one name would add an entry; the certificate is made without it.
  EXPECT_FALSE(MakeTlsIdentity({"a,IP:1.2.3.4", "b\nc", "@section", ""}, 1'800'000'000).certificate.empty());
}

GreetingFacts Facts() { return {"https://cart-3:8480/", std::string(64, 'a'), "/run/token", "AB:CD", true}; }

TEST(Greeting, TheTokenIsForATerminalOnly) {
  const std::string kept = Greeting(Facts(), false);
  EXPECT_EQ(kept.find(std::string(64, 'a')), std::string::npos);
  EXPECT_NE(kept.find("/run/token"), std::string::npos);
  EXPECT_NE(kept.find("AB:CD"), std::string::npos);
  EXPECT_EQ(kept.find('\033'), std::string::npos) << "no QR code in a file";
  const std::string shown = Greeting(Facts(), true);
  EXPECT_NE(shown.find("open https://cart-3:8480/#" + std::string(64, 'a')), std::string::npos);
  EXPECT_NE(shown.find("SHA-256 AB:CD"), std::string::npos);
  EXPECT_NE(shown.find(QrCode("https://cart-3:8480/#" + std::string(64, 'a'))), std::string::npos);
}

TEST(Greeting, AQrCodeIsASquareOfHalfBlocks) {
  const std::string code = QrCode("https://cart-3:8480/#" + std::string(64, 'a'));
  std::set<std::size_t> widths;
  std::size_t lines = 0, width = 0;
  for (std::size_t i = 0; i < code.size(); ++i) {
    const auto c = static_cast<unsigned char>(code[i]);
    if (c == '\033') {
      while (code[i] != 'm') ++i;
    } else if (c == '\n') {
      widths.insert(width);
      width = 0;
      ++lines;
    } else if ((c & 0xc0u) != 0x80u) {
      ++width;
    }
  }
  ASSERT_EQ(widths.size(), 1u);
  EXPECT_EQ((*widths.begin() + 1) / 2, lines);
  EXPECT_NE(code, QrCode("https://cart-3:8480/#" + std::string(64, 'b')));
  EXPECT_TRUE(QrCode(std::string(5000, 'x')).empty());
}

}  // namespace
}  // namespace fulcrum::console
