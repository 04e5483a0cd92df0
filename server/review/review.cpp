#include "server/review/review.hpp"

#include "protocols/bus/log_file.hpp"
#include "server/review/gathering.hpp"

namespace parhelion::review {

Result<SessionReview> review_session(const std::string& path, const ReviewLimits& limits,
                                     const std::function<void(std::uint64_t, std::uint64_t)>& progress,
                                     Reader for_whom, const std::string& robot) {
  auto reader = LogReader::open(path);
  if (!reader) return reader.error();
  Gathering gathering(path, limits, for_whom, robot);
  while (true) {
    auto next = reader->next();
    if (!next) continue;  // damage: counted below; reading continues behind it
    if (!*next) break;
    if (const Status taken = gathering.take(**next); !taken) return taken.error();
    if (progress) progress(reader->offset(), reader->size());
  }
  auto review = gathering.result(reader->skipped_bytes());
  if (review && for_whom == Reader::instructor) review->marks = read_marks(notes_path(path));
  return review;
}

}  // namespace parhelion::review
