// Requests of pages and their effects.
#include "server/station/instructor_service.hpp"

#include <gmock/gmock.h>

#include <fstream>

#include "tests/server/station/feed_fixture.hpp"
#include "tests/server/tick/level_1.hpp"
#include "tests/temporary_folder.hpp"

namespace parhelion::test {
namespace {

using testing::HasSubstr;

class InstructorServiceTest : public FeedTest {
 protected:
  void begin(const tick::Configuration& configuration, station::InstructorOptions options = {},
             bool recorded = false) {
    start(configuration, recorded);
    for (const char* channel : kInstructorChannels) EXPECT_TRUE(server_->subscribe(channel, 1000).ok());
    options.audit = [this](const station::Identity& who, const std::string&, const std::string& what,
                           const std::string& outcome) {
      audit_.push_back(who.name + ": " + what + ": " + outcome);
    };
    service_ = std::make_unique<station::InstructorService>(
        *bus_, *feed_, *station::SessionNotes::open(folder_ / "notes.jsonl"), std::move(options));
    feed_->event_received = [this](const Event& event) { service_->handle(event); };
  }
  std::vector<InstructorCommand> commands() {
    std::vector<InstructorCommand> all;
    Message message;
    while (*server_->receive(message, Duration{0})) {
      InstructorCommand command = command_on(message.channel).value();
      EXPECT_TRUE(decode(message.channel, message.payload, command).ok());
      all.push_back(command);
      feed_->take(message, now());
    }
    return all;
  }
  void answer(const InstructorCommand& command, EventKind kind, const std::string& text = {}) {
    Event event;
    event.stamp = at(t_);
    event.kind = kind;
    event.subject = subject_of(command);
    event.request = request_of(command);
    event.text = text;
    take(channel::kMrEvents, event);
  }

  TemporaryFolder folder_;
  MemoryBusHub hub_;
  std::unique_ptr<Bus> bus_ = hub_.connect(), server_ = hub_.connect();
  std::unique_ptr<station::InstructorService> service_;
  std::vector<std::string> audit_;
};

TEST_F(InstructorServiceTest, PublishesCommandsAndReturnsReplies) {
  begin(configuration({}));
  const auto client = open(1), other = open(2);
  service_->receive(*client, R"({"type":"agent","request":5,"action":"spawn","name":"box_1","x":1,"y":2})",
                    now());
  const auto sent = commands();
  ASSERT_EQ(sent.size(), 1U);
  EXPECT_EQ(std::get<AgentSpawn>(sent[0]).agent.name, "box_1");
  EXPECT_NE(request_of(sent[0]), 0U);
  EXPECT_TRUE(client->newest("reply").is_null());  // no effect until the server confirms it
  answer(sent[0], EventKind::command_accepted);
  const auto reply = client->newest("reply");
  EXPECT_EQ(reply["request"], 5);
  EXPECT_EQ(reply["ok"], true);
  EXPECT_TRUE(other->newest("reply").is_null());
  EXPECT_THAT(audit_, testing::ElementsAre("ada: spawn box_1: done"));
}

TEST_F(InstructorServiceTest, AServerRefusalIsForwardedWithItsOriginalText) {
  begin(configuration({}));
  const auto client = open();
  service_->receive(*client, R"({"type":"agent","request":6,"action":"remove","name":"nobody"})", now());
  answer(commands().at(0), EventKind::command_refused, "no agent 'nobody'");
  EXPECT_EQ(client->newest("reply")["ok"], false);
  EXPECT_EQ(client->newest("reply")["text"], "no agent 'nobody'");
}

TEST_F(InstructorServiceTest, ScriptsAndFaultsAreSentToTheServerAndAnswered) {
  begin(configuration({}));
  const auto client = open();
  service_->receive(*client, R"({"type":"script","request":1,"name":"door slams"})", now());
  service_->receive(*client, R"({"type":"fault","request":2,"kind":"camera_delay","amount":0.3})", now());
  const auto sent = commands();
  ASSERT_EQ(sent.size(), 2U);
  EXPECT_EQ(std::get<ScriptStart>(sent[0]).script, "door slams");
  EXPECT_EQ(std::get<FaultCommand>(sent[1]).amount, 0.3);
  EXPECT_TRUE(client->newest("reply").is_null());
  answer(sent[0], EventKind::command_refused, "no script 'door slams': the scenario has none");
  EXPECT_EQ(client->newest("reply")["request"], 1);
  EXPECT_EQ(client->newest("reply")["ok"], false);
  answer(sent[1], EventKind::command_accepted);
  EXPECT_EQ(client->newest("reply")["request"], 2);
  EXPECT_EQ(client->newest("reply")["ok"], true);
  EXPECT_THAT(audit_, testing::ElementsAre(HasSubstr("ada: script door slams: no script"),
                                           "ada: fault camera_delay: done"));
}

TEST_F(InstructorServiceTest, AServerThatDoesNotAnswerIsReported) {
  begin(configuration({}));
  const auto client = open();
  service_->receive(*client, R"({"type":"agent","request":7,"action":"freeze"})", now());
  t_ = 2;
  service_->look(now());
  EXPECT_TRUE(client->newest("reply").is_null());
  t_ = 4;
  service_->look(now());
  EXPECT_EQ(client->newest("reply")["ok"], false);
  EXPECT_EQ(client->newest("reply")["request"], 7);
}

TEST_F(InstructorServiceTest, TraineesMayReportButNotCommandAndBothAreLogged) {
  begin(configuration({}));
  const auto trainee = open(1, station::Role::trainee, "tom");
  for (const char* text :
       {R"({"type":"agent","request":1,"action":"remove_all"})", R"({"type":"end","seen":0,"request":1})",
        R"({"type":"save","request":1,"name":"mine"})", R"({"type":"mark","request":1,"text":"x"})",
        R"({"type":"fault","request":1,"kind":"dead_wheel","side":"left"})",
        R"({"type":"script","request":1,"name":"s"})",
        R"({"type":"control","seen":0,"request":1,"action":"pause"})"}) {
    service_->receive(*trainee, text, now());
    EXPECT_EQ(trainee->newest("reply")["ok"], false) << text;
    EXPECT_THAT(trainee->newest("reply")["text"].get<std::string>(), HasSubstr("trainees may not")) << text;
  }
  EXPECT_TRUE(commands().empty());
  EXPECT_EQ(audit_.size(), 7U);
  service_->receive(*trainee, R"({"type":"report","request":2,"name":"gauge 1","x":1,"y":2})", now());
  const auto sent = commands();
  ASSERT_EQ(sent.size(), 1U);
  EXPECT_EQ(std::get<ObjectReport>(sent[0]).position, Eigen::Vector2d(1, 2));
}

TEST_F(InstructorServiceTest, AnObserverCannotSendCommands) {
  for (int kind = 0; kind <= static_cast<int>(station::ClientMessage::Kind::estop_release); ++kind) {
    const auto each = static_cast<station::ClientMessage::Kind>(kind);
    EXPECT_EQ(station::may(station::Role::observer, each, false),
              each == station::ClientMessage::Kind::subscribe)
        << to_string(each);
    EXPECT_EQ(station::may(station::Role::observer, each, true),
              each == station::ClientMessage::Kind::subscribe)
        << to_string(each);
    EXPECT_TRUE(station::may(station::Role::instructor, each, false)) << to_string(each);
    EXPECT_TRUE(station::may(station::Role::admin, each, false)) << to_string(each);
  }
}

/// The page has reported by then that it failed. A stop is never too late. The session's time is no measure
/// of the delay: here it stands, as in a pause.
TEST_F(InstructorServiceTest, AMessageThatTheConnectionDelayedChangesNothing) {
  std::vector<std::string> done;
  station::InstructorOptions options;
  options.emergency_stop = [&](bool on, const std::string&, const station::Identity&) {
    return done.emplace_back(on ? "stop" : "release"), Status();
  };
  options.controls.end = [&] { return done.emplace_back("end"), Status(); };
  options.controls.pause = [&](bool) { return done.emplace_back("pause"), Status(); };
  begin(level_1(), options);
  const auto client = open();
  pass(1);
  const double clock = client->newest("control")["clock"];
  const auto send = [&](const std::string& message, double ago) {
    service_->receive(*client, message + R"(,"request":3,"seen":)" + std::to_string(clock - ago) + "}",
                      now());
    return client->newest("reply");
  };
  const std::vector<std::string> messages{R"({"type":"estop_release")",
                                          R"({"type":"agent","action":"remove_all")", R"({"type":"end")",
                                          R"({"type":"control","action":"pause")"};
  for (const double ago : {-5.0, 2.1, 1000.0}) {
    for (const std::string& message : messages) {
      const auto reply = send(message, ago);
      EXPECT_EQ(reply["ok"], false) << message << ago;
      EXPECT_THAT(reply["text"].get<std::string>(), HasSubstr(ago < 0 ? "started again" : "delayed"));
    }
  }
  EXPECT_TRUE(done.empty());
  EXPECT_TRUE(commands().empty());
  service_->receive(*client, R"({"type":"estop","request":4})", now());
  for (const std::string& message : messages) send(message, 1.9);
  EXPECT_THAT(done, testing::ElementsAre("stop", "release", "end", "pause"));
  EXPECT_EQ(commands().size(), 1U);
}

/// Pressed again after the connection hung, it would stand twice. The notes of a recording are no exception.
TEST_F(InstructorServiceTest, AChatLineOrMarkThatTheConnectionDelayedIsNotKept) {
  for (const bool recorded : {false, true}) {
    begin(configuration({}), {}, recorded);
    const auto client = open();
    pass(1);
    const double clock = client->newest("control")["clock"];
    const auto send = [&](const char* type, const char* text, double ago) {
      service_->receive(
          *client,
          nlohmann::json{{"type", type}, {"text", text}, {"request", 3}, {"seen", clock - ago}}.dump(),
          now());
      return client->newest("reply");
    };
    for (const char* type : {"chat", "mark"}) {
      for (const double ago : {-5.0, 2.1, 1000.0}) {
        const auto reply = send(type, "late", ago);
        EXPECT_EQ(reply["ok"], false) << type << ago;
        EXPECT_THAT(reply["text"].get<std::string>(), HasSubstr("Repeat it"));
      }
      EXPECT_TRUE(client->messages_of_type(type).empty()) << type << recorded;
      EXPECT_EQ(send(type, "in time", 1.9)["ok"], true) << type;
      ASSERT_EQ(client->messages_of_type(type).size(), 1U) << type << recorded;
      EXPECT_EQ(client->newest(type)["text"], "in time");
    }
  }
}

TEST_F(InstructorServiceTest, AReleaseWithoutItsTimeIsRefused) {
  station::InstructorOptions options;
  bool released = false;
  options.emergency_stop = [&](bool on, const std::string&, const station::Identity&) {
    released = !on;
    return Status();
  };
  begin(configuration({}), options);
  const auto client = open();
  service_->receive(*client, R"({"type":"estop_release","request":3})", now());
  EXPECT_EQ(client->newest("reply")["ok"], false);
  EXPECT_THAT(client->newest("reply")["text"].get<std::string>(), HasSubstr("seen"));
  EXPECT_FALSE(released);
}

TEST_F(InstructorServiceTest, ASessionWithARealRobotCannotBePaused) {
  begin(configuration({}));
  const auto client = open();
  pass(1);
  const std::string clock = client->newest("control")["clock"].dump();
  service_->receive(*client, R"({"type":"control","request":3,"action":"pause","seen":)" + clock + "}",
                    now());
  EXPECT_EQ(client->newest("reply")["ok"], false);
  EXPECT_THAT(client->newest("reply")["text"].get<std::string>(), HasSubstr("real robot"));
}

TEST_F(InstructorServiceTest, NothingCanBePlacedInARecording) {
  begin(configuration({}), {}, true);
  const auto client = open();
  service_->receive(*client, R"({"type":"agent","request":3,"action":"freeze"})", now());
  EXPECT_EQ(client->newest("reply")["ok"], false);
  EXPECT_TRUE(commands().empty());
}

TEST_F(InstructorServiceTest, PauseRateSeekAndEndBecomePlayerCommands) {
  std::vector<std::string> done;
  station::InstructorOptions options;
  options.controls.pause = [&](bool paused) { return done.push_back(paused ? "pause" : "resume"), Status(); };
  options.controls.rate = [&](double) { return Status(Error{"too fast"}); };
  options.controls.seek = [&](double s) { return done.push_back("seek " + std::to_string(s)), Status(); };
  options.controls.end = [&] { return done.emplace_back("end"), Status(); };
  begin(configuration({}), options, true);
  const auto client = open();
  service_->receive(*client, R"({"type":"control","seen":0,"request":1,"action":"pause"})", now());
  service_->receive(*client, R"({"type":"control","seen":0,"request":2,"action":"resume"})", now());
  service_->receive(*client, R"({"type":"control","seen":0,"request":3,"action":"seek","value":12.5})",
                    now());
  service_->receive(*client, R"({"type":"end","seen":0,"request":4})", now());
  EXPECT_THAT(done, testing::ElementsAre("pause", "resume", "seek 12.500000", "end"));
  EXPECT_EQ(client->newest("reply")["ok"], true);
  service_->receive(*client, R"({"type":"control","seen":0,"request":5,"action":"rate","value":3})", now());
  EXPECT_EQ(client->newest("reply")["text"], "too fast");
  service_->receive(*client, R"({"type":"control","seen":0,"request":6,"action":"step"})", now());
  EXPECT_EQ(client->newest("reply")["ok"], false);
}

TEST_F(InstructorServiceTest, AnAccountWithTheNameOfARoleDoesNotReadMessagesToThatRole) {
  begin(configuration({}));
  const auto ada = open(1, station::Role::instructor, "ada"), tom = open(2, station::Role::trainee, "tom"),
             namesake = open(3, station::Role::trainee, "instructor"),
             everybody = open(4, station::Role::observer, "all");
  service_->receive(*tom, R"({"type":"chat","to_role":"instructor","text":"a word to the staff"})", now());
  EXPECT_EQ(ada->newest("chat")["to_role"], "instructor");
  EXPECT_TRUE(namesake->messages_of_type("chat").empty());
  service_->receive(*tom, R"({"type":"chat","to_person":"instructor","text":"a word to a friend"})", now());
  EXPECT_EQ(namesake->newest("chat")["to_person"], "instructor");
  EXPECT_EQ(ada->messages_of_type("chat").size(), 1U);
  service_->receive(*ada, R"({"type":"chat","to_person":"all","text":"to one"})", now());
  EXPECT_EQ(everybody->newest("chat")["text"], "to one");
  EXPECT_EQ(tom->messages_of_type("chat").size(), 2U) << "his own two";
  ListeningClient later(5, station::Role::trainee, "instructor");
  service_->greet(later);
  EXPECT_EQ(later.messages_of_type("chat").size(), 1U);

  service_->receive(
      *tom, R"({"type":"chat","request":7,"to_role":"instructor","to_person":"ada","text":"x"})", now());
  EXPECT_EQ(tom->newest("reply")["ok"], false) << "to one or the other";
  EXPECT_NE(tom->newest("reply").dump().find("'to_role' and 'to_person' exclude one another"),
            std::string::npos)
      << tom->newest("reply");
}

TEST_F(InstructorServiceTest, MessagesReachTheirRecipientsAndAreKeptBesideTheSession) {
  begin(configuration({}));
  const auto ada = open(1, station::Role::instructor, "ada"), tom = open(2, station::Role::trainee, "tom"),
             bo = open(3, station::Role::observer, "bo");
  service_->receive(*ada, R"({"type":"chat","to_role":"trainee","text":"mind the <b>door</b>"})", now());
  EXPECT_EQ(tom->newest("chat")["text"], "mind the <b>door</b>");
  EXPECT_EQ(ada->messages_of_type("chat").size(), 1U);
  EXPECT_TRUE(bo->messages_of_type("chat").empty());
  service_->receive(*ada, R"({"type":"mark","text":"first hesitation"})", now());
  EXPECT_EQ(bo->newest("mark")["by"], "ada");
  ListeningClient later(4, station::Role::trainee, "tim");
  service_->greet(later);
  EXPECT_EQ(later.messages_of_type("chat").size(), 1U);
  EXPECT_TRUE(later.messages_of_type("mark").empty()) << "they are the instructor's";

  std::ifstream file(folder_ / "notes.jsonl");
  std::string line;
  ASSERT_TRUE(std::getline(file, line));
  EXPECT_EQ(nlohmann::json::parse(line)["text"], "mind the <b>door</b>");
  ASSERT_TRUE(std::getline(file, line));
  EXPECT_EQ(nlohmann::json::parse(line)["type"], "mark");
  EXPECT_TRUE(commands().empty());
}

TEST_F(InstructorServiceTest, SavesPlacedEntitiesAsAReadableScenario) {
  station::InstructorOptions options;
  options.scenarios = folder_ / "scenarios";
  begin(configuration({agent("box_1", AgentKind::box, 1, 0)}), options);
  const auto client = open();
  service_->receive(
      *client, R"({"type":"agent","request":1,"action":"spawn","name":"person_1","kind":"person","x":2,"y":1,
                           "behaviour":"go","waypoints":[[3,3]]})",
      now());
  const InstructorCommand spawn = commands().at(0);
  answer(spawn, EventKind::agent_spawned);
  answer(spawn, EventKind::command_accepted);
  kWorld({body("box_1", "box", AgentKind::box, 1.5), body("person_1", "torso", AgentKind::person, 2.25),
          body("stranger", "box", AgentKind::box, 0)});
  service_->receive(*client, R"({"type":"save","request":2,"name":"placed"})", now());
  ASSERT_EQ(client->newest("reply")["ok"], true) << client->newest("reply");
  EXPECT_THAT(client->newest("reply")["text"].get<std::string>(), HasSubstr("stranger"));
  const auto saved = load_scenario(folder_ / "scenarios/placed.yaml");
  ASSERT_TRUE(saved) << saved.error().message;
  ASSERT_EQ(saved->agents.size(), 2U);
  EXPECT_NEAR(saved->agents[0].T_map_base.translation().x(), 1.5, 1e-9);
  EXPECT_EQ(saved->agents[1].behaviour.kind, BehaviourKind::go);
  service_->receive(*client, R"({"type":"save","request":3,"name":"placed"})", now());
  EXPECT_THAT(client->newest("reply")["text"].get<std::string>(), HasSubstr("exists already"));
}

TEST_F(InstructorServiceTest, AFloodingPageIsClosed) {
  begin(configuration({}));
  const auto client = open();
  for (int i = 0; i < 200 && !client->closed; ++i)
    service_->receive(*client, R"({"type":"subscribe"})", now());
  EXPECT_EQ(client->closed, 1008);
}

TEST_F(InstructorServiceTest, OneTraineeCannotFillTheNotesOrCrowdOutOthers) {
  begin(configuration({}));
  const auto tom = open(1, station::Role::trainee, "tom"), ada = open(2);
  const std::string words(2000, 'x');
  const std::string chat = R"({"type":"chat","request":1,"text":")" + words + "\"}";
  for (int i = 0; i < 20; ++i) service_->receive(*tom, chat, now());
  EXPECT_EQ(ada->messages_of_type("chat").size(), 3U) << "at once; then two a second";
  EXPECT_THAT(tom->newest("reply")["text"].get<std::string>(), HasSubstr("two a second"));
  EXPECT_FALSE(tom->closed);
  for (int second = 0; second < 600; ++second) {
    t_ += 1;
    for (int i = 0; i < 5; ++i) service_->receive(*tom, chat, now());
  }
  EXPECT_FALSE(tom->closed);
  EXPECT_NEAR(static_cast<double>(ada->messages_of_type("chat").size()), 1150, 60);
  EXPECT_LE(std::filesystem::file_size(folder_ / "notes.jsonl"), 1'100'000U);
  service_->receive(*ada, R"({"type":"chat","request":9,"text":"enough"})", now());
  EXPECT_EQ(ada->newest("reply")["ok"], true);
  EXPECT_EQ(tom->newest("chat")["text"], "enough");
}

}  // namespace
}  // namespace parhelion::test
