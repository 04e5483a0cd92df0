// Progress of a long command: a line with the remaining time on a terminal, JSON lines elsewhere. Used by
// every subcommand.
#pragma once

#include <chrono>
#include <cstdio>
#include <string>
#include <string_view>

namespace parhelion::tools {

/// Text of one progress line; `elapsed` in seconds. On a terminal "import  43 %  12.1 of 28.0 MB  6 s left",
/// else
/// {"task":"import","done":12.1,"total":28,"unit":"MB","elapsed_s":5,"left_s":6}. A total of 0 is unknown: no
/// percentage.
std::string progress_line(std::string_view task, double done, double total, std::string_view unit,
                          double elapsed, bool terminal);

/// Writes progress to `stream`: at most five lines a second on a terminal, one a second elsewhere, none in
/// the first second, so that a quick command prints nothing.
class Progress {
 public:
  /// `unit` names what is counted ("MB", "scans"). A null stream is silent.
  Progress(std::string task, std::string unit, std::FILE* stream = stderr);
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;
  ~Progress();

  void update(double done, double total);
  /// Ends the line, so that later output starts on a new one.
  void finish();

 private:
  using Clock = std::chrono::steady_clock;
  std::string task_, unit_;
  std::FILE* stream_;
  bool terminal_;
  bool line_open_ = false;
  Clock::time_point start_, next_;
};

}  // namespace parhelion::tools
