#include "server/station/web/page_files.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <sstream>

namespace parhelion::station {
namespace {

HttpRequest asks_for(std::string path, std::string accept_encoding = "") {
  HttpRequest request;
  request.method = "GET";
  request.path = std::move(path);
  request.accept_encoding = std::move(accept_encoding);
  return request;
}

std::string header(const HttpResponse& response, std::string_view name) {
  for (const auto& [key, value] : response.headers)
    if (key == name) return value;
  return "";
}

TEST(PageFiles, EveryBuiltFileIsServedUnchanged) {
  const std::filesystem::path dist = std::filesystem::path(PARHELION_SOURCE_DIR) / "server/station/web/dist";
  int files = 0;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(dist)) {
    if (!entry.is_regular_file()) continue;
    std::stringstream content;
    content << std::ifstream(entry.path(), std::ios::binary).rdbuf();
    const std::string path = "/" + std::filesystem::relative(entry.path(), dist).string();
    const HttpResponse response = page_response(asks_for(path));
    EXPECT_EQ(response.status, 200) << path;
    EXPECT_TRUE(response.body == content.str()) << path;
    ++files;
  }
  EXPECT_GE(files, 3);
}

TEST(PageFiles, BrowsersReceiveCompressedFiles) {
  const HttpResponse plain = page_response(asks_for("/assets/index.js"));
  const HttpResponse compressed = page_response(asks_for("/assets/index.js", "gzip, deflate, br"));
  EXPECT_EQ(header(compressed, "Content-Encoding"), "gzip");
  EXPECT_EQ(header(plain, "Content-Encoding"), "");
  EXPECT_LT(compressed.body.size(), plain.body.size() / 2);
  EXPECT_EQ(compressed.type, "text/javascript; charset=utf-8");
}

TEST(PageFiles, CachedFilesAreNotSentAgain) {
  HttpRequest request = asks_for("/");
  const HttpResponse first = page_response(request);
  EXPECT_EQ(first.type, "text/html; charset=utf-8");
  request.if_none_match = header(first, "ETag");
  ASSERT_FALSE(request.if_none_match.empty());
  const HttpResponse again = page_response(request);
  EXPECT_EQ(again.status, 304);
  EXPECT_TRUE(again.body.empty());
}

TEST(PageFiles, SetupLinkOpensThePage) {
  EXPECT_EQ(page_response(asks_for("/setup")).body, page_response(asks_for("/")).body);
}

TEST(PageFiles, MissingFilesAreRefused) {
  for (const char* path : {"/nothing", "/assets/", "", "/../index.html", "/index.html/"})
    EXPECT_EQ(page_response(asks_for(path)).status, 404) << path;
}

}  // namespace
}  // namespace parhelion::station
