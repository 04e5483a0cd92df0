// Damages files at random, and reads them in child processes with limits of memory and time.
#pragma once

#include <fcntl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <exception>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <random>
#include <string>
#include <vector>

#include "protocols/status.hpp"
#include "tests/file_bytes.hpp"

namespace parhelion::test {

inline void replace_file(const std::filesystem::path& path, const std::string& bytes) {
  std::ofstream(path, std::ios::binary).write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
}

/// The same damage for the same seed.
class Mutator {
 public:
  explicit Mutator(std::uint64_t seed) : random_(seed) {}

  std::string operator()(std::string bytes) {
    for (std::size_t left = below(3) == 0 ? 2 + below(4) : 1; left > 0 && !bytes.empty(); --left)
      damage(bytes);
    return bytes;
  }

 private:
  std::size_t below(std::size_t n) { return n == 0 ? 0 : random_() % n; }

  void damage(std::string& bytes) {
    switch (below(8)) {
      case 0:
        return bytes.resize(below(bytes.size()));
      case 1:
        return copy_block(bytes);
      case 2:
        bytes.erase(below(bytes.size()), 1 + below(64));
        return;
      case 3:
      case 4:
        return set_length(bytes);
      case 5:
        return set_number(bytes);
      default:
        for (std::size_t flips = 1 + below(4); flips > 0; --flips)
          bytes[below(bytes.size())] ^= static_cast<char>(1U << below(8));
    }
  }

  /// Inserts a copy, once or many times, or writes it over other bytes.
  void copy_block(std::string& bytes) {
    const std::size_t from = below(bytes.size());
    const std::string block = bytes.substr(from, 1 + below(below(2) == 0 ? 8 : 512));
    const std::size_t to = below(bytes.size());
    if (below(2) == 0) {
      bytes.replace(to, block.size(), block);
      return;
    }
    std::string inserted;
    const std::size_t copies = below(4) == 0 ? 1 + below(2000) : 1;
    for (std::size_t i = 0; i < copies; ++i) inserted += block;
    bytes.insert(to, inserted);
  }

  /// Overwrites 1 to 8 bytes with a number that a length field should not have.
  void set_length(std::string& bytes) {
    constexpr std::uint64_t lengths[] = {0,           0x7f,       0xff,       0x7fff,
                                         0xffff,      0x10000000, 0x3fffffff, 0x7fffffff,
                                         0x80000000U, 0xfffffff0, 0xffffffff, 0x7fffffffffffffff,
                                         ~0ULL};
    const std::uint64_t length = lengths[below(std::size(lengths))];
    const std::size_t width = std::size_t{1} << below(4);
    const std::size_t at = below(bytes.size());
    const bool big_endian = below(2) == 0;
    for (std::size_t i = 0; i < width && at + i < bytes.size(); ++i)
      bytes[at + i] = static_cast<char>(length >> (8 * (big_endian ? width - 1 - i : i)));
  }

  /// The same for numbers in text.
  void set_number(std::string& bytes) {
    const char* numbers[] = {"-1",    "0",    "99999999", "2147483648", "18446744073709551616",
                             "1e300", "-1e9", "nan",      "1e-300",     "inf"};
    const auto digit = [](char c) { return c >= '0' && c <= '9'; };
    const std::size_t start = below(bytes.size());
    const auto first = std::find_if(bytes.begin() + static_cast<std::ptrdiff_t>(start), bytes.end(), digit);
    if (first == bytes.end()) return set_length(bytes);
    const auto end = std::find_if_not(first, bytes.end(), digit);
    const std::string number = numbers[below(std::size(numbers))];
    bytes.replace(first, end, number);
  }

  std::mt19937_64 random_;
};

template <class T>
Status status_of(const Result<T>& result) {
  return result ? Status() : Status(result.error());
}

/// What is read: the files are written already, and each is damaged in turn.
struct MutationSample {
  std::vector<std::filesystem::path> files;
  std::function<Status()> read;
};

struct MutationResult {
  std::size_t files = 0, accepted = 0, refused = 0;
  double worst = 0;                 ///< s of processor time
  std::vector<std::string> deaths;  ///< also where an error has no message; with the damaged file
};

namespace mutation {

struct Report {
  std::uint32_t number = 0;
  enum Outcome : std::uint32_t { accepted, refused, no_message, exception } outcome = accepted;
  double seconds = 0;
  char what[200] = {};  ///< of an exception
};

constexpr unsigned kHungAfter = 60;  // s, also on a busy machine

/// s, of this process and of those that it has waited for.
inline double processor_time() {
  double sum = 0;
  for (const int who : {RUSAGE_SELF, RUSAGE_CHILDREN}) {
    rusage used{};
    getrusage(who, &used);
    for (const timeval& time : {used.ru_utime, used.ru_stime})
      sum += static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
  }
  return sum;
}

inline Report read_once(const MutationSample& sample, std::uint32_t number) {
  Report report;
  report.number = number;
  const double begun = processor_time();
  alarm(kHungAfter);
  try {
    const Status read = sample.read();
    if (!read) report.outcome = read.error().message.empty() ? Report::no_message : Report::refused;
  } catch (const std::exception& error) {
    report.outcome = Report::exception;
    std::snprintf(report.what, sizeof report.what, "%s", error.what());
  }
  alarm(0);
  report.seconds = processor_time() - begun;
  return report;
}

class Runner {
 public:
  Runner(MutationSample sample, std::uint64_t seed, std::size_t n)
      : sample_(std::move(sample)), seed_(seed), n_(n) {
    for (const auto& file : sample_.files) originals_.push_back(bytes_of(file));
  }

  MutationResult operator()() {
    while (next_ < n_) run_child();
    result_.files = n_;
    return std::move(result_);
  }

 private:
  void damage(std::size_t i) const {
    const std::size_t file = i % sample_.files.size();
    replace_file(sample_.files[file], Mutator(seed_ + i)(originals_[file]));
  }
  void restore(std::size_t i) const {
    const std::size_t file = i % sample_.files.size();
    replace_file(sample_.files[file], originals_[file]);
  }

  /// Reads files until all are read or one of them ends the child.
  void run_child() {
    int ends[2];
    if (pipe(ends) != 0) throw std::runtime_error("no pipe");
    const pid_t child = fork();
    if (child == 0) {
      close(ends[0]);
      read_all(ends[1]);
    }
    close(ends[1]);
    Report report;
    while (read(ends[0], &report, sizeof report) == static_cast<ssize_t>(sizeof report)) take(report);
    close(ends[0]);
    int status = 0;
    waitpid(child, &status, 0);
    if (WIFSIGNALED(status)) die(strsignal(WTERMSIG(status)));
    if (WIFEXITED(status) && WEXITSTATUS(status) != 0) die("exit " + std::to_string(WEXITSTATUS(status)));
  }

  [[noreturn]] void read_all(int pipe_end) const {
    for (const int output : {STDOUT_FILENO, STDERR_FILENO}) close(output);  // libraries write there
    for (int i = 0; i < 2; ++i) (void)open("/dev/null", O_WRONLY);
#ifndef PARHELION_ADDRESS_SANITIZER  // its shadow memory takes terabytes of addresses
    const rlimit memory{std::uint64_t{1} << 30U, std::uint64_t{1} << 30U};
    setrlimit(RLIMIT_AS, &memory);
#endif
    const rlimit no_core{0, 0};
    setrlimit(RLIMIT_CORE, &no_core);
    for (std::size_t i = next_; i < n_; ++i) {
      damage(i);
      const Report report = read_once(sample_, static_cast<std::uint32_t>(i));
      if (report.outcome < Report::no_message) restore(i);
      if (write(pipe_end, &report, sizeof report) != static_cast<ssize_t>(sizeof report)) _exit(2);
      if (report.outcome >= Report::no_message) _exit(0);
    }
    _exit(0);
  }

  void take(const Report& report) {
    result_.worst = std::max(result_.worst, report.seconds);
    if (report.outcome == Report::no_message) return die("an error without a message");
    if (report.outcome == Report::exception) return die(std::string("exception: ") + report.what);
    if (report.seconds > 5) return die("more than 5 s of processor time");
    ++(report.outcome == Report::accepted ? result_.accepted : result_.refused);
    ++next_;
  }

  /// The damaged file is kept for whoever looks for the reason.
  void die(const std::string& how) {
    const auto& file = sample_.files[next_ % sample_.files.size()];
    const auto kept = std::filesystem::temp_directory_path() /
                      ("parhelion-mutated-" + std::to_string(next_) + "-" + file.filename().string());
    std::error_code ignored;
    std::filesystem::copy_file(file, kept, std::filesystem::copy_options::overwrite_existing, ignored);
    result_.deaths.push_back("file " + std::to_string(next_) + " (" + kept.string() + "): " + how);
    restore(next_++);
  }

  MutationSample sample_;
  std::uint64_t seed_;
  std::size_t n_, next_ = 0;
  std::vector<std::string> originals_;
  MutationResult result_;
};

}  // namespace mutation

/// Reads `n` damaged copies of the sample, each with at most 1 GB of address space and 5 s of processor time.
inline MutationResult read_mutated(MutationSample sample, std::uint64_t seed, std::size_t n) {
  return mutation::Runner(std::move(sample), seed, n)();
}

}  // namespace parhelion::test
