// Grades a session log from its recording, without simulation.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "protocols/bus/bus.hpp"
#include "server/tick/configuration.hpp"
#include "server/training/grader.hpp"

namespace parhelion::runtime {

struct GradedSession {
  std::string log, scenario, robot;
  training::Grade grade;
  std::uint64_t skipped_bytes = 0;  ///< lost to damage in the log, and not graded
};

/// Incremental grading for callers that read the log anyway: call take() with every message, in the log's
/// order.
class SessionGrading {
 public:
  /// `path`: for error messages.
  explicit SessionGrading(std::string path);
  ~SessionGrading();

  /// Error: as grade_session; no further calls after one.
  Status take(const Message& message);
  /// nullptr before MR_SESSION; also set where MR_SESSION is refused for lack of `training`.
  const tick::Configuration* configuration() const;
  /// nullptr before MR_SESSION, and where the robot is not graded.
  const training::Grader* grader(const std::string& robot) const;
  /// Of all graded robots.
  Result<std::vector<GradedSession>> results(std::uint64_t skipped_bytes) const;

 private:
  class Reading;
  std::unique_ptr<Reading> reading_;
};

/// Error: not a session log, a scenario without `training`, or a training that names missing objects. A
/// truncated log is graded as far as it goes (Grade::complete is false). `progress`: bytes done and in total;
/// may be empty. `robot`: one of several that are graded; empty: the first.
Result<GradedSession> grade_session(const std::string& path,
                                    const std::function<void(std::uint64_t, std::uint64_t)>& progress = {},
                                    const std::string& robot = {});
/// The same of all graded robots.
Result<std::vector<GradedSession>> grade_robots(
    const std::string& path, const std::function<void(std::uint64_t, std::uint64_t)>& progress = {});

/// For people, and for programs (numbers convert back to the same bits).
std::string to_text(const GradedSession& session);
std::string to_json(const GradedSession& session);

}  // namespace parhelion::runtime
