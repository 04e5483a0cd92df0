// The test over damaged files, in parts: each lists the readers of one kind of file. It accepts a file or
// gives an error with a message. It never crashes, and never takes more than 5 s of processor time or 1 GB.
#pragma once

#include <gtest/gtest.h>

#include <cctype>

#include "tests/mutation.hpp"
#include "tests/temporary_folder.hpp"
#include "tools/validate.hpp"

namespace parhelion::tools {

struct MutatedReader {
  const char* name;
  std::function<test::MutationSample(const test::TemporaryFolder&)> sample;
  std::size_t part = 1;  ///< of the files: 10 means a tenth of them, for a reader that takes long
};

class MutatedFiles : public testing::TestWithParam<MutatedReader> {};

/// The reader's name without other characters than letters and digits.
inline std::string reader_name(const testing::TestParamInfo<MutatedReader>& chosen) {
  std::string name = chosen.param.name;
  std::erase_if(name, [](char c) { return std::isalnum(static_cast<unsigned char>(c)) == 0; });
  return name;
}

inline Status validate(const std::string& path) {
  const Validation found = validate_file(path);
  return found.errors.empty() ? Status() : Status(Error{found.errors[0]});
}

/// The first file, which may name the others.
inline test::MutationSample validated(const std::vector<std::filesystem::path>& files) {
  return {files, [path = files[0].string()] { return validate(path); }};
}

/// Files of the repository.
inline test::MutationSample copied(const test::TemporaryFolder& folder,
                                   const std::vector<std::string>& from) {
  std::vector<std::filesystem::path> files;
  for (const std::string& each : from) {
    files.emplace_back(folder / std::filesystem::path(each).filename().string());
    std::filesystem::copy_file(std::filesystem::path(PARHELION_SOURCE_DIR) / each, files.back());
  }
  return validated(files);
}

}  // namespace parhelion::tools
