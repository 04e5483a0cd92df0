// A headless OpenGL ES 3.1 context: a GPU through EGL's device platform if available, else Mesa's surfaceless
// platform (software). Private to this module's sources.
#pragma once

#include <memory>
#include <string>

#include "protocols/status.hpp"
#include "render/gl.hpp"

namespace parhelion::render {

class EglContext {
 public:
  /// Loads EGL at run time; `library` is changed only in tests. Error: what is missing and which packages to
  /// install.
  static Result<std::unique_ptr<EglContext>> create(const std::string& library = "libEGL.so.1");
  ~EglContext();
  EglContext(const EglContext&) = delete;
  EglContext& operator=(const EglContext&) = delete;

  /// Makes it current on the calling thread, which must be the same for the context's lifetime.
  void make_current();
  const Gl& gl() const { return gl_; }
  /// The renderer's name as reported by the driver.
  const std::string& renderer() const { return renderer_; }

 private:
  struct Display;
  EglContext() = default;

  std::shared_ptr<Display> display_;
  void* context_ = nullptr;
  Gl gl_;
  std::string renderer_;
};

}  // namespace parhelion::render
