// The page's own files, compiled in.
#pragma once

#include <string_view>

namespace parhelion::review {

/// By the name of the file in server/review/page; empty: there is none.
std::string_view page_text(std::string_view name);

}  // namespace parhelion::review
