#include "services/transport/keys/documents.h"

#include <array>

#include "services/transport/bus/topics.h"

namespace fulcrum::keys {
namespace {

constexpr const char* kHead = "<?xml version=\"1.0\" encoding=\"utf-8\"?>\n<dds>\n";

std::string Domains(int first, int last) {
  return "<domains><id_range><min>" + std::to_string(first) + "</min><max>" + std::to_string(last) +
         "</max></id_range></domains>\n";
}

std::string Topics(const char* verb, bus::TopicSet set) {
  std::string text;
  for (const bus::TopicRole& role : bus::kTopicRoles) {
    if (bus::Contains(set, role.id)) text += std::string("<topic>") + role.name + "</topic>";
  }
  return text.empty() ? text : std::string("<") + verb + "><topics>" + text + "</topics></" + verb + ">\n";
}

/// The participant that joins two hosts writes and reads the link's topics in both directions, on either host.
std::string LinkRule() {
  std::string topics;
  for (const std::string_view topic : bus::kLinkTopics) topics += "<topic>" + std::string(topic) + "</topic>";
  return "<allow_rule>\n" + Domains(bus::kFirstLinkDomain, bus::kLastLinkDomain) + "<publish><topics>" + topics +
         "</topics></publish>\n<subscribe><topics>" + topics + "</topics></subscribe>\n</allow_rule>\n";
}

/// Topics of this version that are named between the tags of a verb.
bus::TopicSet TopicsIn(const std::string& document, const std::string& verb) {
  const std::size_t from = document.find("<" + verb + ">");
  const std::size_t to = document.find("</" + verb + ">");
  if (from == std::string::npos || to == std::string::npos || to < from) return 0;
  const std::string_view part = std::string_view(document).substr(from, to - from);
  bus::TopicSet set = 0;
  for (const bus::TopicRole& role : bus::kTopicRoles) {
    if (part.find(std::string("<topic>") + role.name + "</topic>") != std::string_view::npos)
      set |= bus::SetOf(role.id);
  }
  return set;
}

std::string Moment(std::time_t time) {
  std::tm parts{};
  gmtime_r(&time, &parts);
  std::array<char, 32> text{};
  std::strftime(text.data(), text.size(), "%Y-%m-%dT%H:%M:%S", &parts);
  return text.data();
}

}  // namespace

std::string SubjectOf(const bus::AccessRole& role) { return "CN=" + std::string(role.identity); }

std::string GovernanceXml(bool encrypt) {
  return std::string(kHead) + "<domain_access_rules><domain_rule>\n" +
         Domains(bus::kFirstCartDomain, bus::kLastLinkDomain) +
         "<allow_unauthenticated_participants>false</allow_unauthenticated_participants>\n"
         "<enable_join_access_control>true</enable_join_access_control>\n"
         "<discovery_protection_kind>NONE</discovery_protection_kind>\n"
         "<liveliness_protection_kind>NONE</liveliness_protection_kind>\n"
         "<rtps_protection_kind>" +
         (encrypt ? "ENCRYPT" : "NONE") +
         "</rtps_protection_kind>\n"
         "<topic_access_rules><topic_rule>\n"
         "<topic_expression>*</topic_expression>\n"
         "<enable_discovery_protection>false</enable_discovery_protection>\n"
         "<enable_liveliness_protection>false</enable_liveliness_protection>\n"
         "<enable_read_access_control>true</enable_read_access_control>\n"
         "<enable_write_access_control>true</enable_write_access_control>\n"
         "<metadata_protection_kind>NONE</metadata_protection_kind>\n"
         "<data_protection_kind>NONE</data_protection_kind>\n"
         "</topic_rule></topic_access_rules>\n"
         "</domain_rule></domain_access_rules>\n</dds>\n";
}

std::string PermissionsXml(const bus::AccessRole& role, const Validity& validity) {
  // The library reads these times as local ones: one more day at both ends. Those of the certificate are exact.
  constexpr std::time_t kDay = 24 * 3600;
  return std::string(kHead) + "<permissions><grant name=\"" + std::string(role.identity) + "\">\n<subject_name>" +
         SubjectOf(role) + "</subject_name>\n<validity><not_before>" + Moment(validity.from - kDay) +
         "</not_before><not_after>" + Moment(validity.until + kDay) + "</not_after></validity>\n<allow_rule>\n" +
         Domains(bus::kFirstCartDomain, bus::kLastCartDomain) + Topics("publish", role.writes) +
         Topics("subscribe", role.reads) + "</allow_rule>\n" +
         (role.identity == bus::kLinkIdentity ? LinkRule() : std::string()) +
         "<default>DENY</default>\n</grant></permissions>\n</dds>\n";
}

std::optional<bus::AccessRole> RightsIn(const std::string& document, std::string_view identity,
                                        const Validity& validity) {
  const bus::AccessRole rights{identity, TopicsIn(document, "publish"), TopicsIn(document, "subscribe")};
  if (PermissionsXml(rights, validity) != document) return std::nullopt;
  return rights;
}

}  // namespace fulcrum::keys
