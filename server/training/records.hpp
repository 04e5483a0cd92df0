// Records of trainees, their sessions and their grades, in an SQLite database.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "protocols/status.hpp"
#include "server/training/grader.hpp"

namespace parhelion::training {

/// Name and mbox_sha1sum are the only personal fields; everything else uses the pseudonym.
struct TraineeRecord {
  std::string pseudonym;     ///< "t-" and 12 hex digits if generated here
  std::string name;          ///< empty: only the pseudonym is known
  std::string mbox_sha1sum;  ///< 40 hex digits of SHA-1 of "mailto:..." (xAPI 1.0.3, 4.1.2.3), or empty
};

/// Whether it has the format of generated pseudonyms: any other may be a person's name.
bool is_pseudonym(const std::string& text);

struct SessionRecord {
  std::string identity;                    ///< the same for the same session, however often it is graded
  std::string scenario, programme, robot;  ///< an empty programme: none
  std::string log;                         ///< file name without its folder
  int level = 0;                           ///< 1 to 3; 0: not known
  std::uint64_t skipped_bytes = 0;         ///< of the log
  Grade grade;
  std::vector<std::vector<std::string>> skills;  ///< skills of each of grade.tasks, sorted; or empty
};

/// A call that returned without an Error survives kill -9 and a power cut. Several programs may open the same
/// records; each write waits up to `patience_ms` for the others. Not thread-safe. Reads no clock: sessions
/// are ordered as stored, so a clock that was set back does not change the order.
class Records {
 public:
  enum class Stored { added, present, replaced };

  /// Error: missing and `create` is false, a newer schema, another program's file, or damaged. Completes an
  /// interrupted erasure.
  static Result<Records> open(const std::string& path, bool create, int patience_ms = 10'000);
  Records(Records&&) noexcept;
  Records& operator=(Records&&) noexcept;
  ~Records();

  /// An empty pseudonym is drawn at random. Error: name, pseudonym or mbox already exists.
  Result<TraineeRecord> add(TraineeRecord trainee);
  /// By pseudonym, name or mbox_sha1sum. Error: none found; names the nearest pseudonym.
  Result<TraineeRecord> find(const std::string& who);
  /// In the order in which they were added.
  Result<std::vector<TraineeRecord>> trainees();
  /// Erases a trainee and all sessions; when it returns without an Error, no file of the database contains a
  /// byte of them.
  Status erase(const std::string& pseudonym);

  /// If the identity exists the session is `present`, and unchanged; with `again` it is replaced. Error: it
  /// belongs to another trainee.
  Result<Stored> store(const std::string& pseudonym, const SessionRecord& session, bool again = false);
  /// In the order in which they were stored.
  Result<std::vector<SessionRecord>> sessions(const std::string& pseudonym);

  /// Transaction: all changes by `work`, or none if it fails.
  Status together(const std::function<Status()>& work);

 private:
  struct State;
  explicit Records(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace parhelion::training
