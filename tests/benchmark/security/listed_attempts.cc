#include "tests/benchmark/security/listed_attempts.h"

#include <array>

#include "tests/support/program.h"

namespace fulcrum {
namespace {

constexpr std::array kAttempts{
    // Another user of the machine.
    ListedAttempt{"control.other_user_private_socket", "control_socket_test",
                  "ControlSocket.AnotherUserReachesNoSocketOfTheDirectory"},
    ListedAttempt{"control.other_user_open_socket", "control_socket_test",
                  "ControlSocket.OnAnOpenSocketTheKernelNamesTheCaller"},
    ListedAttempt{"control.malformed_packet", "control_socket_test", "ControlSocket.PacketsThatAreNoRequestAreRefused"},
    ListedAttempt{"control.silent_clients", "control_socket_test", "ControlSocket.SilentClientsDoNotKeepOthersOut"},
    ListedAttempt{"session.other_user_same_domain", "supervisor_guard_test",
                  "DomainGuard.AnotherUsersSessionIsRefusedByName"},
    ListedAttempt{"session.foreign_samples", "bus_dds_topics_test",
                  "DdsInput.SamplesOfAnotherSessionAreDroppedAndCounted"},
    ListedAttempt{"session.forged_announcement", "bus_dds_topics_test",
                  "DdsParticipant.OnlyAPeerOfThisSessionCanBeAMismatch"},
    ListedAttempt{"datagram.forged_stamp", "security_forgery_test",
                  "Forgery.ASampleWithoutTheSessionsNumberIsDroppedAndCounted"},
    ListedAttempt{"datagram.earlier_session", "security_forgery_test",
                  "Forgery.PacketsOfAnEarlierSessionAreDroppedAndCounted"},
    ListedAttempt{"bus.encrypted_overheard", "security_test", "SecuredSession.EncryptedCannotBeOverheard"},
    // Commands of a user who may send some.
    ListedAttempt{"swap.command_line", "supervisor_guard_test", "Swap.ACommandLineNeedsTheSessionsPermission"},
    ListedAttempt{"swap.path_as_build", "supervisor_guard_test", "Swap.APathIsNoBuild"},
    ListedAttempt{"swap.other_words", "supervisor_guard_test", "Swap.NothingElseIsTaken"},
    // A second machine.
    ListedAttempt{"link.no_or_wrong_keys", "link_refusal_test", "LinkKeys.AreNeededAndMustBeTheSame"},
    ListedAttempt{"link.start_without_keys", "link_refusal_test", "LinkKeys.TheCommandsEndWithoutThem"},
    ListedAttempt{"link.other_address", "link_refusal_test", "LinkAddress.ADatagramFromAThirdAddressIsDroppedAndNamed"},
    ListedAttempt{"link.host_elsewhere", "link_refusal_test",
                  "LinkAddress.AHostAtAnotherAddressThanThePeerNeverConnects"},
    ListedAttempt{"link.command", "link_refusal_test", "LinkRefusal.ACommandIsRefusedOnBothSides"},
    ListedAttempt{"link.foreign_topic_to_cart", "link_refusal_test",
                  "LinkRefusal.FromTheHostTheCartTakesSamplesOfTheHostsNodesOnly"},
    ListedAttempt{"link.foreign_topic_to_host", "link_refusal_test",
                  "LinkRefusal.FromTheCartAHostTakesNothingOfItsOwnNodes"},
    ListedAttempt{"link.replayed_packets", "link_refusal_test",
                  "LinkRefusal.PacketsOfAnotherSessionAndOfAnEarlierLinkAreRefused"},
    ListedAttempt{"link.offer_from_the_host", "link_refusal_test", "LinkRefusal.OnlyTheCartOffersAndEndsASession"},
    ListedAttempt{"link.path_as_name", "link_refusal_test", "LinkRefusal.AnOfferWithAPathInsteadOfANameIsRefused"},
    ListedAttempt{"link.number_as_index", "link_refusal_test",
                  "LinkRefusal.AReceivedEnumeratorIsNoIndexBeforeItIsChecked"},
    ListedAttempt{"link.flood_of_requests", "link_refusal_test",
                  "LinkRefusal.AFloodOfRequestsIsAnsweredAtABoundedRate"},
    ListedAttempt{"link.path_in_a_cart", "supervisor_parts_test",
                  "OfferedCart.APathInAReceivedCartIsRefusedWithItsKey"},
    // The console.
    ListedAttempt{"console.no_token", "console_parts_test", "Router.EveryCallNeedsTheToken"},
    ListedAttempt{"console.part_of_the_token", "console_parts_test", "Access.OnlyTheWholeTokenOpens"},
    ListedAttempt{"console.other_site", "console_parts_test", "Router.PagesOfOthersAreRefused"},
    ListedAttempt{"console.other_host_name", "console_parts_test", "Access.HostsOfOthersAreRefused"},
    ListedAttempt{"console.path_as_file", "console_parts_test", "Form.NamesOfFilesCannotLeaveTheirFolder"},
    ListedAttempt{"console.a_thousand_silent", "console_siege_test",
                  "SiegeTest.TheOperatorIsAnsweredBesideAThousandSilentConnections"},
    ListedAttempt{"console.plain_http_from_outside", "console_siege_test",
                  "SiegeTest.BeyondThisMachineEverythingIsOverTls"},
    // A process of the cart that was taken over.
    ListedAttempt{"node.starts_a_program", "confinement_test", "Confinement.NoNodeStartsAProgramOrOpensAForeignSocket"},
    ListedAttempt{"node.writes_elsewhere", "confinement_test", "Confinement.ANodeWritesOnlyWhatItMust"},
};

}  // namespace

std::span<const ListedAttempt> ListedAttempts() { return kAttempts; }

bool IsRefused(const ListedAttempt& attempt, std::string* said) {
  testing::Program test(attempt.program, {std::string("--gtest_filter=") + attempt.test});
  const int code = test.End(0);
  *said = test.Said();
  // A name that no test has would pass as well, and so would one that is skipped.
  return code == 0 && said->find("[  PASSED  ] 1 test") != std::string::npos;
}

}  // namespace fulcrum
