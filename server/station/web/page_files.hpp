// The built page (`dist`), compiled in, as the web server's answers.
#pragma once

#include <string_view>

#include "server/station/http/http_message.hpp"

namespace parhelion::station {

struct PageFile {
  std::string_view path;  ///< as a URL's: "/assets/index.js"
  std::string_view type;  ///< media type
  std::string_view etag;  ///< with its quotes; changes with the content
  std::string_view gzip;  ///< the content, compressed
};

/// nullptr: there is none. "/" and "/setup" are index.html.
const PageFile* page_file(std::string_view path);

/// The answer to a GET: the file compressed where the asker takes that, 304 where it has it, 404 where there
/// is none.
HttpResponse page_response(const HttpRequest& request);

}  // namespace parhelion::station
