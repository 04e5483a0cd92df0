// The recorded surface of a site, for the simulated camera.
#include <cstddef>

#include "render/layer_renderer.hpp"

namespace parhelion::render {
namespace {

const void* offset_of(std::size_t bytes) { return reinterpret_cast<const void*>(bytes); }

}  // namespace

void LayerRenderer::set_site(const SiteSurface& surface, const SitePicture& picture) {
  context_.make_current();
  if (site_array_ == 0) {
    gl_.GenVertexArrays(1, &site_array_);
    gl_.GenBuffers(2, site_buffers_);
    gl_.GenTextures(1, &site_texture_);
  }
  site_chunks_ = surface.mesh.chunks;
  gl_.BindVertexArray(site_array_);
  gl_.BindBuffer(GL_ARRAY_BUFFER, site_buffers_[0]);
  gl_.BufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(surface.vertices.size() * sizeof(SiteVertex)),
                 surface.vertices.data(), GL_STATIC_DRAW);
  attribute(0, 3, sizeof(SiteVertex), offsetof(SiteVertex, position), 0);
  attribute(1, 2, sizeof(SiteVertex), offsetof(SiteVertex, place), 0);
  attribute(2, 1, sizeof(SiteVertex), offsetof(SiteVertex, recorded), 0);
  gl_.BindBuffer(GL_ELEMENT_ARRAY_BUFFER, site_buffers_[1]);
  gl_.BufferData(GL_ELEMENT_ARRAY_BUFFER,
                 static_cast<GLsizeiptr>(surface.indices.size() * sizeof(std::uint32_t)),
                 surface.indices.data(), GL_STATIC_DRAW);
  gl_.ActiveTexture(GL_TEXTURE0);
  gl_.BindTexture(GL_TEXTURE_2D, site_texture_);
  gl_.PixelStorei(GL_UNPACK_ALIGNMENT, 1);
  gl_.TexImage2D(GL_TEXTURE_2D, 0, GL_RGBA8, picture.width, picture.height, 0, GL_RGBA, GL_UNSIGNED_BYTE,
                 picture.rgba.data());
  // No mipmaps: they would mix patches that are neighbours only in the picture.
  gl_.TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
  gl_.TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
  gl_.TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
  gl_.TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
}

/// Both sides, as what is seen from behind is shown as unseen.
void LayerRenderer::draw_site(const std::vector<std::uint32_t>& chunks) {
  if (chunks.empty()) return;
  gl_.BindVertexArray(site_array_);
  gl_.ActiveTexture(GL_TEXTURE0);
  gl_.BindTexture(GL_TEXTURE_2D, site_texture_);
  gl_.Disable(GL_CULL_FACE);
  for (std::size_t i = 0; i < chunks.size();) {
    const std::uint32_t first = site_chunks_[chunks[i]].first;
    std::uint32_t count = 0;  // adjacent ranges are drawn in one call
    for (; i < chunks.size() && site_chunks_[chunks[i]].first == first + count; ++i)
      count += site_chunks_[chunks[i]].count;
    gl_.DrawElementsInstanced(GL_TRIANGLES, static_cast<GLsizei>(count), GL_UNSIGNED_INT,
                              offset_of(first * sizeof(std::uint32_t)), 1);
  }
  gl_.Enable(GL_CULL_FACE);
}

void LayerRenderer::release_site() {
  if (site_array_ == 0) return;
  gl_.DeleteVertexArrays(1, &site_array_);
  gl_.DeleteBuffers(2, site_buffers_);
  gl_.DeleteTextures(1, &site_texture_);
}

}  // namespace parhelion::render
