// LCM over the loopback. Each test has its own port, so that it does not receive messages of other programs.
#include <gtest/gtest.h>
#include <sched.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <random>

#include "protocols/bus/bus.hpp"
#include "protocols/bus/network_speaker.hpp"
#include "tests/protocols/raw_datagrams.hpp"

namespace parhelion {
namespace {

std::string own_url() {
  static int used = 0;
  const int port = 20000 + (static_cast<int>(getpid()) * 8 + used++) % 40000;
  return "udpm://239.255.76.67:" + std::to_string(port) + "?ttl=0&recv_buf_size=4194304";
}

/// Opens a bus, or skips the test where the machine has no multicast route.
#define OPEN_OR_SKIP(bus, url)                                                                \
  auto bus##_opened = open_network_bus(url);                                                  \
  if (!bus##_opened && bus##_opened.error().message.find("multicast") != std::string::npos) { \
    GTEST_SKIP() << bus##_opened.error().message;                                             \
  }                                                                                           \
  ASSERT_TRUE(bus##_opened) << bus##_opened.error().message;                                  \
  Bus& bus = **bus##_opened

bool receive_within(Bus& bus, Message& message, Duration timeout) {
  const auto came = bus.receive(message, timeout);
  EXPECT_TRUE(came) << came.error().message;
  return came && *came;
}

TEST(NetworkBus, ASendOnlyEndpointSendsAndReceivesNothing) {
  const std::string url = own_url();
  OPEN_OR_SKIP(receiver, url);
  ASSERT_TRUE(receiver.subscribe("TELEOP", 4));
  const auto speaker = open_network_speaker(url);
  ASSERT_TRUE(speaker) << speaker.error().message;
  ASSERT_TRUE((*speaker)->publish("TELEOP", std::vector<std::uint8_t>{1, 2}).ok());
  Message message;
  ASSERT_TRUE(receive_within(receiver, message, seconds(2)));
  EXPECT_EQ(message.payload, (std::vector<std::uint8_t>{1, 2}));
  EXPECT_FALSE((*speaker)->subscribe("TELEOP", 4).ok());
  EXPECT_FALSE((*speaker)->receive(message, Duration{0}).ok());
  EXPECT_FALSE(open_network_speaker("tcpq://localhost").ok());
}

TEST(NetworkBus, SendersHaveNumbersOfTheirOwn) {
  const std::string url = own_url();
  OPEN_OR_SKIP(receiver, url);
  OPEN_OR_SKIP(one, url);
  OPEN_OR_SKIP(other, url);
  ASSERT_TRUE(receiver.subscribe("TELEOP", 4));
  std::vector<std::uint64_t> senders;
  for (Bus* bus : {&one, &other, &one}) {
    ASSERT_TRUE(bus->publish("TELEOP", std::vector<std::uint8_t>{1}).ok());
    Message message;
    ASSERT_TRUE(receive_within(receiver, message, seconds(2)));
    senders.push_back(message.sender);
  }
  EXPECT_NE(senders[0], 0U);
  EXPECT_NE(senders[0], senders[1]);
  EXPECT_EQ(senders[0], senders[2]);
}

TEST(NetworkBus, AMessageOf300kBArrivesUnchanged) {
  const std::string url = own_url();
  OPEN_OR_SKIP(sender, url);
  OPEN_OR_SKIP(receiver, url);
  ASSERT_TRUE(receiver.subscribe("CAMERA", 4));
  std::vector<std::uint8_t> payload(300'000);
  std::mt19937 random(3);
  for (auto& byte : payload) byte = static_cast<std::uint8_t>(random());
  Message message;
  // UDP may lose a fragment, so it is sent again until a complete message arrives.
  bool came = false;
  for (int attempt = 0; attempt < 20 && !came; ++attempt) {
    ASSERT_TRUE(sender.publish("CAMERA", payload));
    came = receive_within(receiver, message, seconds(1));
  }
  ASSERT_TRUE(came);
  EXPECT_EQ(message.channel, "CAMERA");
  EXPECT_EQ(message.payload, payload);
  EXPECT_GT(message.arrival.ns, 0);
}

TEST(NetworkBus, ALateReceiverGetsTheNewestMessageAndADropCount) {
  const std::string url = own_url();
  OPEN_OR_SKIP(bus, url);
  ASSERT_TRUE(bus.subscribe("TELEOP", 2));
  ASSERT_TRUE(bus.subscribe("END", 1));
  constexpr std::uint8_t sent = 50;
  for (std::uint8_t i = 0; i < sent; ++i) ASSERT_TRUE(bus.publish("TELEOP", std::vector<std::uint8_t>{i}));
  Message message;
  std::vector<std::uint8_t> received;
  // Once END is queued, all earlier messages are queued too.
  ASSERT_TRUE(bus.publish("END", {}));
  std::uint64_t got = 0;
  while (receive_within(bus, message, seconds(5)) && message.channel != "END")
    received.push_back(message.payload.at(0)), ++got;
  EXPECT_TRUE(std::is_sorted(received.begin(), received.end()));
  ASSERT_FALSE(received.empty());
  EXPECT_EQ(received.back(), sent - 1);
  EXPECT_EQ(got + bus.dropped(), sent);
}

TEST(NetworkBus, ADatagramToTheMachinesOwnAddressIsNotReceived) {
  const std::string url = own_url();
  OPEN_OR_SKIP(bus, url);
  ASSERT_TRUE(bus.subscribe("TELEOP", 4));
  test::RawSender(url, "127.0.0.1").send(test::short_message({"TELEOP", {}, {1}}));
  test::RawSender(url).send(test::short_message({"TELEOP", {}, {2}}));
  Message message;
  ASSERT_TRUE(receive_within(bus, message, seconds(2)));
  EXPECT_EQ(message.payload, std::vector<std::uint8_t>{2});
  EXPECT_FALSE(receive_within(bus, message, milliseconds(50)));
}

TEST(NetworkBus, DatagramsThatLieAboutTheirLengthsAreNotReceivedAndDoNoHarm) {
  const std::string url = own_url();
  OPEN_OR_SKIP(bus, url);
  ASSERT_TRUE(bus.subscribe("SCAN", 100));
  const test::RawSender stranger(url);
  for (std::uint32_t i = 0; i < 100; ++i) {
    for (const test::FragmentHeader& header : {test::FragmentHeader{3 * i, 100'000, 0xFFFF'FFF0U, 1, 2},
                                               test::FragmentHeader{3 * i + 1, 60'000, 0, 0, 1},
                                               test::FragmentHeader{3 * i + 2, 200'000'000, 0, 0, 60'000}})
      stranger.send(test::fragment(header, "SCAN", test::Datagram(8, 7)));
  }
  stranger.send(test::short_message({"SCAN", {}, {1, 2, 3}}));
  Message message;
  ASSERT_TRUE(receive_within(bus, message, seconds(2)));
  EXPECT_EQ(message.payload, (std::vector<std::uint8_t>{1, 2, 3}));
  EXPECT_FALSE(receive_within(bus, message, milliseconds(50)));
}

TEST(NetworkBus, OtherTransportsAndBrokenUrlsAreRefusedWithAnExample) {
  for (const char* url : {"tcpq://localhost", "file://a.log", "rubbish", "udpm://not-an-address:1"}) {
    const auto bus = open_network_bus(url);
    ASSERT_FALSE(bus) << url;
    EXPECT_NE(bus.error().message.find(url), std::string::npos);
    EXPECT_NE(bus.error().message.find("expected"), std::string::npos) << bus.error().message;
  }
}

TEST(NetworkBus, TheErrorWithoutAMulticastRouteExplainsHowToAddOne) {
  int report[2];
  ASSERT_EQ(pipe(report), 0);
  const pid_t child = fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    // A separate network namespace has no route at all.
    if (unshare(CLONE_NEWNET) != 0 && unshare(CLONE_NEWUSER | CLONE_NEWNET) != 0) _exit(77);
    const auto bus = open_network_bus("");
    const std::string error_text = bus ? "opened" : bus.error().message;
    _exit(write(report[1], error_text.data(), error_text.size()) == static_cast<ssize_t>(error_text.size())
              ? 0
              : 1);
  }
  close(report[1]);
  std::string error_text;
  char part[512];
  for (ssize_t n; (n = ::read(report[0], part, sizeof part)) > 0;)
    error_text.append(part, static_cast<std::size_t>(n));
  close(report[0]);
  int status = 0;
  ASSERT_EQ(waitpid(child, &status, 0), child);
  ASSERT_TRUE(WIFEXITED(status));
  if (WEXITSTATUS(status) == 77) GTEST_SKIP() << "this machine allows no network namespace";
  EXPECT_EQ(WEXITSTATUS(status), 0);
  EXPECT_NE(error_text.find("ip route replace 224.0.0.0/4 dev lo src 127.0.0.1"), std::string::npos)
      << error_text;
}

}  // namespace
}  // namespace parhelion
