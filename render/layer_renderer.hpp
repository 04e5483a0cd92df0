// Draws a list into a layer over the image: premultiplied colour with coverage, and depth with entity id.
// Private to this module.
#pragma once

#include <array>
#include <map>
#include <memory>
#include <vector>

#include "render/draw_list.hpp"
#include "render/egl_context.hpp"
#include "render/site_surface.hpp"

namespace parhelion::render {

/// The drawn content over `rect` of an image, row by row.
struct Layer {
  PixelRect rect;
  std::vector<std::uint8_t> rgba;  ///< premultiplied sRGB and coverage; black with coverage: shadow
  std::vector<std::uint32_t>
      depth_id;  ///< quarter millimetres along the optical axis << 10 | entity; 0: no body

  std::size_t at(int x, int y) const {
    return static_cast<std::size_t>(y - rect.y0) * static_cast<std::size_t>(rect.width()) +
           static_cast<std::size_t>(x - rect.x0);
  }
};

inline double layer_depth(std::uint32_t depth_id) { return (depth_id >> 10) * 0.00025; }
inline std::uint32_t layer_entity(std::uint32_t depth_id) { return depth_id & 1023U; }

/// Anti-aliasing of a layer that was drawn with one sample per pixel: where colour, coverage or entity change
/// between pixels, a 3x3 binomial filter (of premultiplied colour). Edges move by less than a quarter of a
/// pixel. `everywhere`: also where there is no body.
void smooth_edges(Layer& layer, bool everywhere = false);

/// The building in a simulated camera's view, drawn before the list; fills every pixel.
struct Scenery {
  std::vector<Instance> boxes;  ///< Instance::metallic is opacity, roughness above 1.5 a floor
  std::vector<Instance> glass;
  std::vector<std::uint32_t> mesh_chunks;  ///< of the building's mesh
  Instance mesh{};
  std::vector<ShadowVertex> shadows;  ///< of the building on its floor
  Transform<Map, CameraOptical> T_map_optical;
  double floor_z = 0;                      ///< m, map
  bool recorded = false;                   ///< the site is drawn as recorded, before neutral stripes
  std::vector<std::uint32_t> site_chunks;  ///< of the recorded surface
};

/// Alpha of pixels that show the recorded surface, in a layer with a recorded site; where nothing was
/// recorded it is less.
inline constexpr std::uint8_t kRecordedAlpha = 255;

/// The meshes, shader programs and frame buffers of one context.
class LayerRenderer {
 public:
  static Result<std::unique_ptr<LayerRenderer>> create(EglContext& context);
  ~LayerRenderer();

  /// Sets the mesh that the chunks of later lists refer to; in the map frame.
  void set_mesh(const BuildingMesh& mesh);

  /// Sets the recorded surface that the chunks of later scenery refer to.
  void set_site(const SiteSurface& surface, const SitePicture& picture);

  /// Starts drawing; the driver may continue asynchronously. `R_optical_map` rotates the lights.
  void draw(const CameraProjection& projection, const DrawList& list, const Eigen::Matrix3d& R_optical_map,
            bool use_occluders, const Scenery* scenery = nullptr);
  /// Waits for the drawing and warps it to the image. Error: what the driver rejected.
  Status read(const CameraProjection& projection, const DrawList& list, Layer& layer);

  /// Depth and entity id only, one sample per pixel: of the shapes, of the occluders, or of both.
  enum class Depth { shapes, occluders, everything };
  void read_depth(const CameraProjection& projection, const DrawList& list, Depth what, Layer& layer);

 private:
  struct Program {
    GLuint id = 0;
    GLint R_view_optical = -1, pinhole = -1, depth_range = -1, up = -1, to_light = -1, R_map_view = -1,
          inverse_pinhole = -1, camera = -1;
  };
  struct Target {
    GLuint framebuffer = 0, colour = 0, identity = 0, depth = 0;
    int width = 0, height = 0;
  };
  explicit LayerRenderer(EglContext& context) : context_(context), gl_(context.gl()) {}

  Status make_program(Program& program, const char* vertex, const std::string& fragment);
  void make_meshes();
  void make_instance_array();
  void attribute(GLuint location, GLint size, std::size_t stride, std::size_t offset, GLuint divisor);
  void shape_attributes();
  void instance_attributes();
  Status ensure(Target& target, int width, int height, int samples, bool colour, bool depth);
  void release(Target& target);
  void use(const Program& program, const PinholeView& view, double far, double bias,
           const Eigen::Matrix3d* R_optical_map);
  void draw_instances(std::size_t mesh, const std::vector<Instance>& instances);
  void draw_mesh(const std::vector<std::uint32_t>& chunks, const Instance& placed);
  void draw_shape_meshes(const std::vector<PlacedMesh>& meshes);
  struct UploadedMesh;
  const UploadedMesh& uploaded(const std::shared_ptr<const ShapeMesh>& mesh);
  void draw_shadows(const std::vector<ShadowVertex>& shadows, bool over_scenery);
  /// Clears the depth of the bound frame buffer; depth test and back-face culling on.
  void begin_depth();
  void draw_view(const PinholeView& view, const PixelRect& rect, const DrawList& list,
                 const Eigen::Matrix3d& R_optical_map, bool use_occluders, const Scenery* scenery);
  void read_view(GLuint framebuffer, const PixelRect& rect, bool colour, std::vector<std::uint8_t>& rgba,
                 std::vector<std::uint32_t>& depth_id);
  void draw_site(const std::vector<std::uint32_t>& chunks);
  void release_site();
  void draw_backdrop(const PinholeView& view, const Scenery& scenery, const Eigen::Matrix3d& R_optical_map);
  void place(const Program& program, const Scenery& scenery, const Eigen::Matrix3d& R);
  void draw_scenery(const PinholeView& view, const Scenery& scenery, double far,
                    const Eigen::Matrix3d& R_optical_map);
  void resolve(const PixelRect& rect);
  bool affords_multisampling(const DrawList& list) const;
  void set_scissor(const PixelRect& rect);

  EglContext& context_;
  const Gl& gl_;
  int samples_ = 4;
  Status refused_;  ///< first error since draw()
  bool software_ = true, multisampling_ = true, filters_scenery_ = false;
  Program lit_, depth_, shadow_, backdrop_, scenery_, site_, unrecorded_;
  struct MeshRange {
    GLsizei count = 0;
    std::size_t offset = 0;  ///< bytes into the index buffer
  };
  std::array<MeshRange, kMeshes> meshes_{};
  std::size_t plain_box_ = 0;
  GLuint vertex_buffer_ = 0, index_buffer_ = 0, instance_buffer_ = 0, shadow_buffer_ = 0;
  GLuint shape_array_ = 0, shadow_array_ = 0, empty_array_ = 0;
  GLuint mesh_array_ = 0, mesh_buffer_ = 0;
  std::vector<MeshChunk> mesh_chunks_, site_chunks_;
  GLuint site_array_ = 0, site_texture_ = 0;
  GLuint site_buffers_[2] = {0, 0};
  struct UploadedMesh {
    std::shared_ptr<const ShapeMesh> mesh;  ///< kept, so that its address stays its own
    GLuint array = 0, buffer = 0;
    GLsizei vertices = 0;
  };
  std::map<const ShapeMesh*, UploadedMesh> shape_meshes_;
  Target multisampled_, resolved_, single_;
  struct ViewPixels {
    PixelRect rect;
    std::vector<std::uint8_t> rgba;
    std::vector<std::uint32_t> depth_id;
  };
  std::vector<ViewPixels> view_pixels_;
  std::vector<std::uint32_t> wide_;  ///< four words per pixel, for drivers that cannot read one

  void warp(const CameraProjection& projection, bool colour, Layer& layer) const;
};

}  // namespace parhelion::render
