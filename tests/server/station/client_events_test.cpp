#include "server/station/client_events.hpp"

#include <gtest/gtest.h>

#include <thread>

namespace parhelion::station {
namespace {

TEST(ClientEvents, FloodingPagesAreRefusedWithoutBlocking) {
  ClientEvents events;
  std::size_t taken = 0;
  while (taken < 10'000 && events.put(ClientText{1, "{}"})) ++taken;
  EXPECT_EQ(taken, ClientEvents::kMaxTexts);
  events.put(ClientDisconnected{1});
  ClientEvent event;
  ASSERT_TRUE(events.take(event, Duration{0}));
  EXPECT_TRUE(events.put(ClientText{2, "{}"})) << "there is room again";
}

TEST(ClientEvents, AreTakenInOrder) {
  ClientEvents events;
  events.put(ClientConnected{});
  ASSERT_TRUE(events.put(ClientText{1, "a"}));
  events.put(ClientDisconnected{1});
  ClientEvent event;
  for (const std::size_t kind : {0, 1, 2}) {
    ASSERT_TRUE(events.take(event, Duration{0}));
    EXPECT_EQ(event.index(), kind);
  }
  EXPECT_FALSE(events.take(event, milliseconds(1)));
}

TEST(ClientEvents, WakeTheWorkerThatWaits) {
  ClientEvents events;
  std::jthread page([&] { events.put(ClientDisconnected{7}); });
  ClientEvent event;
  ASSERT_TRUE(events.take(event, seconds(5.0)));
  EXPECT_EQ(std::get<ClientDisconnected>(event).client, 7U);
}

}  // namespace
}  // namespace parhelion::station
