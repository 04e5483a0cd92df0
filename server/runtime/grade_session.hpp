// A session log, graded again: what was recorded decides, nothing is simulated.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "protocols/bus/bus.hpp"
#include "server/tick/configuration.hpp"
#include "server/training/grader.hpp"

namespace parhelion::runtime {

struct GradedSession {
  std::string log, scenario, robot;
  training::Grade grade;
  std::uint64_t skipped_bytes = 0;  ///< lost to damage in the log: what they held is not graded
};

/// The same for those who read the log anyhow: feed it every message, in the log's order.
class SessionGrading {
 public:
  /// `path`: for the words of errors.
  explicit SessionGrading(std::string path);
  ~SessionGrading();

  /// Error: as of grade_session; nothing is to be fed after one.
  Status take(const Message& message);
  /// nullptr before MR_SESSION; there where that is refused for want of `training`, too.
  const tick::Configuration* configuration() const;
  /// nullptr before MR_SESSION.
  const training::Grader* grader() const;
  Result<GradedSession> result(std::uint64_t skipped_bytes) const;

 private:
  class Reading;
  std::unique_ptr<Reading> reading_;
};

/// Error: no session log, a scenario without `training`, or a training that names what is not there. A log
/// that stops in the middle is graded as far as it goes (Grade::complete is false). `progress`: bytes done
/// and of all; may be empty.
Result<GradedSession> grade_session(const std::string& path,
                                    const std::function<void(std::uint64_t, std::uint64_t)>& progress = {});

/// For a person, and for programs (numbers read back to the same bits).
std::string to_text(const GradedSession& session);
std::string to_json(const GradedSession& session);

}  // namespace parhelion::runtime
