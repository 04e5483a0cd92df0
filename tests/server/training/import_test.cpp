// Import of records: once, all or nothing.
#include <gmock/gmock.h>

#include <nlohmann/json.hpp>

#include "tests/server/training/exported_group.hpp"
#include "tests/server/training/records_fixture.hpp"

namespace parhelion::training {
namespace {

using test::group;
using testing::HasSubstr;

class ImportTest : public test::OpenRecordsTest {};

TEST_F(ImportTest, ARepeatedImportAddsOnceAndAFailedOneNothing) {
  Histories histories{group(), 0};
  histories.trainees[1].trainee.mbox_sha1sum = "none";
  EXPECT_FALSE(take(*records_, histories).ok());
  EXPECT_TRUE(records_->trainees()->empty());
  histories.trainees = group();
  const auto first = take(*records_, histories), second = take(*records_, histories);
  ASSERT_TRUE(first.ok()) << first.error().message;
  EXPECT_EQ(first->trainees, 3U);
  EXPECT_EQ(first->sessions, 3U);
  EXPECT_EQ(second->trainees, 0U);
  EXPECT_EQ(second->sessions, 0U);
  EXPECT_EQ(second->present, 3U);
  // An export in another format is the same.
  const auto statements = histories_from_xapi(to_xapi(group(), "https://school.example"), "a");
  EXPECT_EQ(take(*records_, *statements)->present, 3U);
}

TEST_F(ImportTest, ATaskWithoutANameIsRefused) {
  auto statements = nlohmann::json::parse(to_xapi(group(), "https://school.example"));
  for (auto& statement : statements) statement["object"]["definition"]["name"] = nlohmann::json::object();
  const auto histories = histories_from_xapi(statements.dump(), "a.json");
  ASSERT_FALSE(histories.ok());
  EXPECT_NE(histories.error().message.find("expected the name of a task"), std::string::npos)
      << histories.error().message;
}

TEST_F(ImportTest, DeepNestingIsRefused) {
  const std::string deep = std::string(300'000, '[') + std::string(300'000, ']');
  for (const std::string& text :
       {deep, "{\"statements\":" + deep + "}", "{\"format\":\"parhelion records\",\"a\":" + deep + "}"}) {
    const auto histories = histories_from(text, "a.json");
    ASSERT_FALSE(histories.ok());
    EXPECT_THAT(histories.error().message, HasSubstr("a.json: nested more than 100 levels deep"));
  }
  EXPECT_TRUE(histories_from("[\"\\\"" + deep + "\"]", "a.json").ok()) << "brackets of a text do not count";
}

TEST_F(ImportTest, ANameGivenAsPseudonymIsStoredAsAName) {
  const std::vector<TraineeHistory> called{{{"Anna Schmidt", "", ""}, {test::recorded_session(1)}},
                                           {{"4711", "Ben", ""}, {}}};
  for (const std::string& text : {to_csv(called), to_json(called)}) {
    const auto taken = take(*records_, *histories_from(text, "a"));
    ASSERT_TRUE(taken.ok()) << taken.error().message;
  }
  const auto trainees = records_->trainees();
  ASSERT_EQ(trainees->size(), 2U) << "twice the same two";
  for (const TraineeRecord& trainee : *trainees) EXPECT_TRUE(is_pseudonym(trainee.pseudonym));
  EXPECT_EQ(trainees->at(0).name, "Anna Schmidt");
  EXPECT_EQ(trainees->at(1).name, "Ben");
}

TEST_F(ImportTest, ASessionOfAnotherTraineeImportsNothing) {
  ASSERT_TRUE(take(*records_, {group(), 0}).ok());
  auto trainees = group();
  trainees[0].trainee = {"t-999999999999", "", ""};
  const auto taken = take(*records_, {trainees, 0});
  ASSERT_FALSE(taken.ok());
  EXPECT_THAT(taken.error().message, HasSubstr("belongs to another trainee: t-0123456789ab"));
  EXPECT_FALSE(records_->find("t-999999999999").ok());
}
}  // namespace
}  // namespace parhelion::training
