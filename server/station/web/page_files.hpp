// The built page (`dist`), compiled in, as HTTP responses.
#pragma once

#include <string_view>

#include "server/station/http/http_message.hpp"

namespace parhelion::station {

struct PageFile {
  std::string_view path;  ///< as a URL's: "/assets/index.js"
  std::string_view type;  ///< media type
  std::string_view etag;  ///< with its quotes; changes with the content
  std::string_view gzip;  ///< the compressed content
};

/// nullptr: no such file. "/" and "/setup" are index.html.
const PageFile* page_file(std::string_view path);

/// The response to a GET: the compressed file if the client accepts it, 304 if the client has it, 404 if
/// there is no such file.
HttpResponse page_response(const HttpRequest& request);

}  // namespace parhelion::station
