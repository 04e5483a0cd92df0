// The after-action page: HTML without external resources. Implemented in page.cpp and page_json.cpp.
#pragma once

#include <string>
#include <vector>

#include "server/review/review.hpp"

namespace parhelion::review {

/// Result of a session, for comparison with others.
struct SessionScore {
  std::string log, scenario;
  training::Grade grade;
};

struct ReviewPage {
  std::vector<SessionReview> sessions;  ///< one, or two to be compared
  std::vector<SessionScore> earlier;    ///< of the same trainee, oldest first
  std::vector<SessionScore> group;      ///< of other trainees
};

/// Deterministic: the same sessions give the same bytes. All names are shown as text, never as markup or
/// script. The page's content security policy allows no other script and no network access.
std::string to_html(const ReviewPage& page);

/// The data that the page draws.
std::string to_json(const ReviewPage& page);

}  // namespace parhelion::review
