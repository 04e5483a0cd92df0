// The after-action page: HTML that needs nothing beside itself.
#pragma once

#include <string>
#include <vector>

#include "server/review/review.hpp"

namespace parhelion::review {

/// What a session came to, for comparison with others.
struct SessionScore {
  std::string log, scenario;
  training::Grade grade;
};

struct ReviewPage {
  std::vector<SessionReview> sessions;  ///< one, or two beside each other
  std::vector<SessionScore> earlier;    ///< the trainee's own, the oldest first
  std::vector<SessionScore> group;      ///< others'
};

/// The same bytes for the same sessions. Whatever names hold is shown as text: none of it is markup or
/// script, and the page's policy lets no other script run and nothing be fetched.
std::string to_html(const ReviewPage& page);

/// What the page draws from.
std::string to_json(const ReviewPage& page);

}  // namespace parhelion::review
