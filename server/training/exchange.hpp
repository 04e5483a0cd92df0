// Import and export of records: JSON (everything), CSV (one line per session), xAPI statements (one for each
// session and each of its tasks).
#pragma once

#include <string>
#include <vector>

#include "server/training/records.hpp"

namespace parhelion::training {

struct TraineeHistory {
  TraineeRecord trainee;  ///< an empty pseudonym is drawn on import
  std::vector<SessionRecord> sessions;
};

/// Contents of an imported file, and the number of skipped items.
struct Histories {
  std::vector<TraineeHistory> trainees;  ///< in order of first appearance
  std::size_t skipped = 0;               ///< xAPI statements without a score, and tasks without their session
};

/// Reading it back gives identical bits.
std::string to_json(const std::vector<TraineeHistory>& trainees);
/// RFC 4180, with a header line; without tasks and deductions. A trainee without sessions has one line.
std::string to_csv(const std::vector<TraineeHistory>& trainees);
/// xAPI 1.0.3, an array: actor by mbox_sha1sum or else as the account `pseudonym` of `home_page`; passed,
/// failed or attempted (incomplete) the activity `scenario`; `timestamp` is the session's end. After it the
/// started tasks: completed, failed or attempted. Without names, causes and deductions; without a score
/// unless it is between 0 and the maximum.
std::string to_xapi(const std::vector<TraineeHistory>& trainees, const std::string& home_page);

/// `origin` is the prefix of Errors, which give the position in the text and the expected content.
Result<Histories> histories_from_json(const std::string& text, const std::string& origin);
Result<Histories> histories_from_csv(const std::string& text, const std::string& origin);
/// An array of statements, a single one, or a StatementResult. Statements of other programs are accepted: a
/// score from `raw` between `min` and `max` (Error: outside), or only `scaled`.
Result<Histories> histories_from_xapi(const std::string& text, const std::string& origin);
/// Detects the format: our JSON, xAPI JSON, or else CSV. A UTF-8 byte-order mark is skipped.
Result<Histories> histories_from(const std::string& text, const std::string& origin);

struct Taken {
  std::size_t trainees = 0, sessions = 0;  ///< new ones
  std::size_t present = 0;                 ///< sessions already stored, unchanged
};
/// All or nothing. The same pseudonym, mbox_sha1sum or name identifies the same trainee. A pseudonym not in
/// our format (is_pseudonym) may be a name and is stored as one, with a new pseudonym. Error: a session
/// belongs to another trainee.
Result<Taken> take(Records& records, const Histories& histories);

}  // namespace parhelion::training
