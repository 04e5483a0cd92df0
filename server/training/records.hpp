// Records of trainees: who they are, what sessions they had and how those were graded. An SQLite database.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "protocols/status.hpp"
#include "server/training/grader.hpp"

namespace parhelion::training {

/// Name and mbox_sha1sum are the only personal things here; all else speaks of the pseudonym.
struct TraineeRecord {
  std::string pseudonym;     ///< "t-" and 12 hex digits where it was made here
  std::string name;          ///< empty: only the pseudonym is known
  std::string mbox_sha1sum;  ///< 40 hex digits of SHA-1 of "mailto:..." (xAPI 1.0.3, 4.1.2.3), or empty
};

/// Whether it has the shape of those made here: what has another may be a person's name.
bool is_pseudonym(const std::string& text);

struct SessionRecord {
  std::string identity;                    ///< the same for the same session, however often it is graded
  std::string scenario, programme, robot;  ///< a programme that is empty: none
  std::string log;                         ///< file name without its folder
  int level = 0;                           ///< 1 to 3; 0: not known
  std::uint64_t damaged_bytes = 0;         ///< of the log
  Grade grade;
  std::vector<std::vector<std::string>> skills;  ///< that each of grade.tasks trains, sorted; or empty
};

/// What a call that returned without an Error has written outlives a kill -9 and a power cut. Several
/// programs may have the same records open; each writing call waits up to `patience_ms` for the others. Not
/// for two threads at once. Reads no clock: sessions are in the order in which they were stored, so that a
/// clock that was set back disorders nothing.
class Records {
 public:
  enum class Stored { added, present, replaced };

  /// Error: not there and not to be made, of a newer schema, another program's, damaged. An erasure that was
  /// cut off is finished.
  static Result<Records> open(const std::string& path, bool create, int patience_ms = 10'000);
  Records(Records&&) noexcept;
  Records& operator=(Records&&) noexcept;
  ~Records();

  /// A pseudonym that is empty is drawn at random. Error: name, pseudonym or mbox is there already.
  Result<TraineeRecord> add(TraineeRecord trainee);
  /// By pseudonym, name or mbox_sha1sum. Error: there is none; names the nearest pseudonym.
  Result<TraineeRecord> find(const std::string& who);
  /// In the order in which they were added.
  Result<std::vector<TraineeRecord>> trainees();
  /// Forgets a trainee and all sessions; when it returns without an Error, no file of the database has a byte
  /// of them.
  Status erase(const std::string& pseudonym);

  /// A session with the same identity is `present`, and unchanged; with `again` it is replaced. Error: it is
  /// another trainee's.
  Result<Stored> store(const std::string& pseudonym, const SessionRecord& session, bool again = false);
  /// In the order in which they were stored.
  Result<std::vector<SessionRecord>> sessions(const std::string& pseudonym);

  /// All that `work` does with these records, or where it fails nothing.
  Status together(const std::function<Status()>& work);

 private:
  struct State;
  explicit Records(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace parhelion::training
