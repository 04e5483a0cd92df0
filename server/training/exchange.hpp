// Records as text that other programs read and write: JSON (everything), CSV (a line for each session), xAPI
// statements (one for each session and each task of it).
#pragma once

#include <string>
#include <vector>

#include "server/training/records.hpp"

namespace parhelion::training {

struct TraineeHistory {
  TraineeRecord trainee;  ///< a pseudonym that is empty: to be drawn when it is taken
  std::vector<SessionRecord> sessions;
};

/// What was read from a file, and what of it is not ours to take.
struct Histories {
  std::vector<TraineeHistory> trainees;  ///< in the order in which they first come
  std::size_t skipped = 0;               ///< xAPI statements without a score, and tasks without their session
};

/// Read back they are the same to the bit.
std::string to_json(const std::vector<TraineeHistory>& trainees);
/// RFC 4180, a header line; without tasks and charges. A trainee without a session has a line of their own.
std::string to_csv(const std::vector<TraineeHistory>& trainees);
/// xAPI 1.0.3, an array: actor by mbox_sha1sum or else as the account `pseudonym` of `home_page`; passed,
/// failed or attempted (incomplete) the activity `scenario`; `timestamp` is the session's end. After it those
/// tasks that were begun: completed, failed or attempted. Without names, causes and charges; without a score
/// where that is not between 0 and what could be earned.
std::string to_xapi(const std::vector<TraineeHistory>& trainees, const std::string& home_page);

/// `origin` begins the Errors, which say where in the text and what was expected.
Result<Histories> histories_from_json(const std::string& text, const std::string& origin);
Result<Histories> histories_from_csv(const std::string& text, const std::string& origin);
/// An array of statements, one alone, or a StatementResult. Others' are taken, too: a score from `raw`
/// between `min` and `max` (Error: it is not), or `scaled` alone.
Result<Histories> histories_from_xapi(const std::string& text, const std::string& origin);
/// By what the text is: ours in JSON, xAPI in JSON, or else CSV. A UTF-8 byte-order mark is skipped.
Result<Histories> histories_from(const std::string& text, const std::string& origin);

struct Taken {
  std::size_t trainees = 0, sessions = 0;  ///< that are new
  std::size_t present = 0;                 ///< sessions that were there already, unchanged
};
/// All or nothing. Who has the same pseudonym, mbox_sha1sum or name is the same trainee. A pseudonym of a
/// shape that is not ours (is_pseudonym) may be a name and is taken as that, for a new pseudonym. Error: a
/// session is another trainee's.
Result<Taken> take(Records& records, const Histories& histories);

}  // namespace parhelion::training
