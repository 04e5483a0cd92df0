// A headless OpenGL ES 3.1 context: a GPU by EGL's device platform where there is one, else Mesa's
// surfaceless platform (software). Private to this room's sources.
#pragma once

#include <memory>
#include <string>

#include "protocols/status.hpp"
#include "render/gl.hpp"

namespace parhelion::render {

class EglContext {
 public:
  /// Loads EGL at run time; `library` is only ever another one in tests. Error: what is missing and which
  /// packages to install.
  static Result<std::unique_ptr<EglContext>> create(const std::string& library = "libEGL.so.1");
  ~EglContext();
  EglContext(const EglContext&) = delete;
  EglContext& operator=(const EglContext&) = delete;

  /// Makes it the calling thread's context; the same thread for the context's whole life.
  void make_current();
  const Gl& gl() const { return gl_; }
  /// What draws, as the driver calls it.
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
