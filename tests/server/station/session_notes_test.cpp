#include "server/station/session_notes.hpp"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <filesystem>
#include <fstream>

#include "tests/temporary_folder.hpp"

namespace parhelion::station {
namespace {

mode_t mode_of(const std::string& path) {
  struct stat file {};
  EXPECT_EQ(stat(path.c_str(), &file), 0) << path;
  return file.st_mode & 0777U;
}

TEST(SessionNotes, AreReadableByTheirOwnerAlone) {
  const test::TemporaryFolder folder;
  ASSERT_TRUE(SessionNotes::open(folder / "new.jsonl").ok());
  EXPECT_EQ(mode_of(folder / "new.jsonl"), 0600U);
  std::ofstream(folder / "old.jsonl") << "{}\n";
  ASSERT_EQ(chmod((folder / "old.jsonl").c_str(), 0644), 0);
  ASSERT_TRUE(SessionNotes::open(folder / "old.jsonl").ok());
  EXPECT_EQ(mode_of(folder / "old.jsonl"), 0600U);
}

TEST(SessionNotes, DoNotFollowALink) {
  const test::TemporaryFolder folder;
  std::ofstream(folder / "private") << "untouched";
  std::filesystem::create_symlink(folder / "private", folder / "notes.jsonl");
  const auto opened = SessionNotes::open(folder / "notes.jsonl");
  ASSERT_FALSE(opened.ok());
  EXPECT_NE(opened.error().message.find("notes.jsonl"), std::string::npos);
  EXPECT_EQ(std::filesystem::file_size(folder / "private"), 9U);
}

}  // namespace
}  // namespace parhelion::station
