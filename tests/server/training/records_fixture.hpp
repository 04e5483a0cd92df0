// Records in the test's own folder.
#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <optional>
#include <string>

#include "server/training/records.hpp"
#include "tests/file_bytes.hpp"
#include "tests/server/training/recorded_session.hpp"

namespace parhelion::test {

class RecordsTest : public testing::Test {
 protected:
  void SetUp() override {
    std::string pattern = (std::filesystem::temp_directory_path() / "parhelion-records-XXXXXX").string();
    ASSERT_NE(mkdtemp(pattern.data()), nullptr);
    folder_ = pattern;
    path_ = (folder_ / "records.db").string();
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  training::Records open(bool create = true) {
    auto records = training::Records::open(path_, create);
    EXPECT_TRUE(records.ok()) << records.error().message;
    return std::move(*records);
  }
  training::TraineeRecord add(training::Records& records, const std::string& name) {
    auto trainee = records.add({"", name, ""});
    EXPECT_TRUE(trainee.ok()) << trainee.error().message;
    return *trainee;
  }
  /// All bytes of all files of the database.
  std::string bytes() const {
    std::string bytes;
    for (const auto& entry : std::filesystem::directory_iterator(folder_)) bytes += bytes_of(entry.path());
    return bytes;
  }

  std::filesystem::path folder_;
  std::string path_;
};

/// The records are open from the start.
class OpenRecordsTest : public RecordsTest {
 protected:
  void SetUp() override {
    RecordsTest::SetUp();
    auto opened = training::Records::open(path_, true);
    ASSERT_TRUE(opened.ok()) << opened.error().message;
    records_.emplace(std::move(*opened));
  }
  void TearDown() override {
    records_.reset();
    RecordsTest::TearDown();
  }

  std::optional<training::Records> records_;
};

}  // namespace parhelion::test
