// Messages of pages are validated before they take effect.
#include "server/station/client_messages.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace parhelion::station {
namespace {

using testing::HasSubstr;

std::string fault(const std::string& text) {
  std::uint64_t request = 0;
  const auto read = read_client_message(text, request);
  return read ? "" : read.error().message;
}

ClientMessage read(const std::string& text) {
  std::uint64_t request = 0;
  const auto message = read_client_message(text, request);
  EXPECT_TRUE(message) << message.error().message;
  return message ? *message : ClientMessage();
}

TEST(ClientMessages, ReadAnAgentWithTheKeysOfAScenario) {
  const ClientMessage message = read(
      R"({"type":"agent","request":7,"action":"spawn","name":"person_1","kind":"person","x":1.5,"y":-2,"yaw":0.5,
          "behaviour":"patrol","speed":1.2,"waypoints":[[1,2],[3,4]],"yields":true,"opens_doors":false})");
  EXPECT_EQ(message.kind, ClientMessage::Kind::agent);
  EXPECT_EQ(message.request, 7U);
  const AgentDefinition& agent = std::get<AgentSpawn>(message.command).agent;
  EXPECT_EQ(agent.name, "person_1");
  EXPECT_EQ(agent.kind, AgentKind::person);
  EXPECT_EQ(agent.T_map_base.translation(), Eigen::Vector3d(1.5, -2, 0));
  EXPECT_DOUBLE_EQ(agent.T_map_base.yaw(), 0.5);
  EXPECT_EQ(agent.behaviour.kind, BehaviourKind::patrol);
  EXPECT_EQ(agent.behaviour.waypoints.size(), 2U);
  EXPECT_TRUE(agent.behaviour.yields);
  EXPECT_FALSE(agent.behaviour.opens_doors);
}

TEST(ClientMessages, ReadTheOpeningOfADoorCommand) {
  const ClientMessage message = read(R"({"type":"agent","action":"door","name":"door 1","opening":0.7})");
  EXPECT_EQ(std::get<DoorCommand>(message.command).opening, 0.7);
  const ClientMessage released = read(R"({"type":"agent","action":"door_unknown","name":"door 1"})");
  EXPECT_EQ(std::get<DoorCommand>(released.command).opening, std::nullopt);
}

TEST(ClientMessages, EveryActionAndKindOfTheSchemaIsKnown) {
  for (const char* action :
       {"spawn", "move", "remove", "behave", "remove_all", "freeze", "unfreeze", "door", "door_unknown"}) {
    const ClientMessage message = read(
        std::string(R"({"type":"agent","name":"a","x":0,"y":0,"opening":0,"action":")") + action + "\"}");
    EXPECT_STREQ(action_of(message.command), action);
  }
  for (const char* action : {"pause", "resume", "step", "rate", "seek"})
    EXPECT_STREQ(
        to_string(
            read(std::string(R"({"type":"control","seen":1,"value":1,"action":")") + action + "\"}").kind),
        action);
}

TEST(ClientMessages, ReadScriptsAndFaultsAsServerCommands) {
  const ClientMessage script = read(R"({"type":"script","request":1,"name":"door slams"})");
  EXPECT_EQ(std::get<ScriptStart>(script.command).script, "door slams");
  const auto fault_in = [](const std::string& text) { return std::get<FaultCommand>(read(text).command); };
  const FaultCommand delay =
      fault_in(R"({"type":"fault","kind":"camera_delay","amount":0.2,"lasting":30,"on":true})");
  EXPECT_EQ(delay.kind, Fault::Kind::camera_delay);
  EXPECT_TRUE(delay.begins);
  EXPECT_EQ(delay.amount, 0.2);
  EXPECT_EQ(delay.duration, 30);
  const FaultCommand right = fault_in(R"({"type":"fault","kind":"dead_wheel","side":"right"})");
  EXPECT_TRUE(right.right);
  EXPECT_EQ(right.duration, std::nullopt);
  EXPECT_FALSE(fault_in(R"({"type":"fault","kind":"dead_wheel","side":"left","lasting":2})").right);
  const FaultCommand over = fault_in(R"({"type":"fault","kind":"camera_loss","on":false})");
  EXPECT_EQ(over.kind, Fault::Kind::camera_loss);
  EXPECT_FALSE(over.begins);
  EXPECT_THAT(fault(R"({"type":"fault","kind":"camera_loss"})"), HasSubstr("'amount'"));
  EXPECT_THAT(fault(R"({"type":"fault","kind":"dead_wheel","amount":1})"), HasSubstr("'side'"));
  EXPECT_THAT(fault(R"({"type":"fault","kind":"earthquake","amount":1})"), HasSubstr("kind"));
  EXPECT_THAT(fault(R"({"type":"fault","kind":"camera_loss","amount":2})"), HasSubstr("amount"));
  EXPECT_THAT(fault(R"({"type":"script"})"), HasSubstr("name"));
}

TEST(ClientMessages, InvalidValuesAreRefusedByTheirKey) {
  EXPECT_THAT(fault(R"({"type":"agent","action":"spawn","name":"a","x":0,"y":0,"colour":"red"})"),
              HasSubstr("colour"));
  EXPECT_THAT(fault(R"({"type":"agent","action":"explode"})"), HasSubstr("action"));
  EXPECT_THAT(fault(R"({"type":"agent","action":"spawn","name":"a","y":0})"), HasSubstr("'x'"));
  EXPECT_THAT(fault(R"({"type":"agent","action":"spawn","name":"a","x":"0","y":0})"), HasSubstr("x"));
  EXPECT_THAT(fault(R"({"type":"agent","action":"spawn","name":"a","x":1e300,"y":0})"), HasSubstr("x"));
  EXPECT_THAT(fault(R"({"type":"agnet"})"), HasSubstr("agent"));
  EXPECT_THAT(fault(R"({"action":"spawn"})"), HasSubstr("type"));
  EXPECT_THAT(fault(R"({"type":"save","name":"../../etc/passwd"})"), HasSubstr("name"));
  EXPECT_THAT(fault(R"({"type":"control","action":"seek","seen":1})"), HasSubstr("value"));
  EXPECT_THAT(fault(R"({"type":"report","name":"gauge","x":1})"), HasSubstr("both"));
  EXPECT_THAT(fault(R"({"type":"subscribe","world_hz":0})"), HasSubstr("world_hz"));
}

/// Without it a delay of the connection goes unnoticed.
TEST(ClientMessages, WhatWouldBeWrongTooLateNeedsItsTime) {
  for (const char* text : {R"({"type":"end"})", R"({"type":"control","action":"pause"})",
                           R"({"type":"control","action":"resume"})", R"({"type":"control","action":"step"})",
                           R"({"type":"control","action":"rate","value":2})",
                           R"({"type":"control","action":"seek","value":2})", R"({"type":"estop_release"})"})
    EXPECT_THAT(fault(text), HasSubstr("seen")) << text;
  for (const char* text : {R"({"type":"end","seen":2.5})", R"({"type":"mark","text":"x","seen":2.5})",
                           R"({"type":"chat","text":"x","seen":2.5})"})
    EXPECT_EQ(read(text).seen, 2.5) << text;
  EXPECT_THAT(fault(R"({"type":"chat","text":"x","seen":-1})"), HasSubstr("seen"));
}

TEST(ClientMessages, InvalidMessagesAreRefused) {
  EXPECT_FALSE(fault("").empty());
  EXPECT_FALSE(fault("[]").empty());
  EXPECT_FALSE(fault("{\"type\":").empty());
  EXPECT_FALSE(fault("{\"type\":\"mark\",\"text\":\"\xff\xfe\"}").empty());
  EXPECT_FALSE(fault(R"({"type":"agent","action":"spawn","name":"a","x":1e999,"y":0})").empty());
  EXPECT_THAT(fault(std::string(60'000, '[')), HasSubstr("deep"));
  EXPECT_THAT(fault(std::string(kMaxClientMessage + 1, ' ')), HasSubstr("bytes"));
}

TEST(ClientMessages, ARefusedMessageKeepsItsRequestId) {
  std::uint64_t request = 0;
  EXPECT_FALSE(read_client_message(R"({"type":"agent","request":12,"action":"explode"})", request));
  EXPECT_EQ(request, 12U);
  EXPECT_FALSE(read_client_message(R"({"type":"agent","request":-3,"action":"freeze"})", request));
  EXPECT_EQ(request, 0U);
}

}  // namespace
}  // namespace parhelion::station
