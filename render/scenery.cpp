// The building and its floor, for the simulated camera.
#include "render/layer_renderer.hpp"

namespace parhelion::render {

void LayerRenderer::place(const Program& program, const Scenery& scenery, const Eigen::Matrix3d& R) {
  const auto f = [](double x) { return static_cast<float>(x); };
  const Eigen::Vector3d camera = scenery.T_map_optical.translation();
  const Eigen::Matrix3f R_map_view = R.cast<float>();
  gl_.UniformMatrix3fv(program.R_map_view, 1, GL_FALSE, R_map_view.data());
  gl_.Uniform4f(program.camera, f(camera.x()), f(camera.y()), f(camera.z()), f(scenery.floor_z));
}

void LayerRenderer::draw_backdrop(const PinholeView& view, const Scenery& scenery,
                                  const Eigen::Matrix3d& R_optical_map) {
  const auto f = [](double x) { return static_cast<float>(x); };
  const Program& program = scenery.recorded ? unrecorded_ : backdrop_;
  gl_.UseProgram(program.id);
  place(program, scenery, R_optical_map.transpose() * view.R_optical_view);
  gl_.Uniform4f(program.inverse_pinhole, f(1 / view.fx), f(view.cx), f(1 / view.fy), f(view.cy));
  gl_.Disable(GL_DEPTH_TEST);
  gl_.Disable(GL_CULL_FACE);
  gl_.BindVertexArray(empty_array_);
  gl_.DrawArrays(GL_TRIANGLES, 0, 3);
  gl_.Enable(GL_DEPTH_TEST);
  gl_.Enable(GL_CULL_FACE);
}

void LayerRenderer::draw_scenery(const PinholeView& view, const Scenery& scenery, double far,
                                 const Eigen::Matrix3d& R_optical_map) {
  draw_backdrop(view, scenery, R_optical_map);
  if (scenery.recorded) {
    use(site_, view, far, 0, nullptr);
    place(site_, scenery, R_optical_map.transpose());
    draw_site(scenery.site_chunks);
  }
  use(scenery_, view, far, 0, &R_optical_map);
  place(scenery_, scenery, R_optical_map.transpose());
  draw_instances(plain_box_, scenery.boxes);
  draw_mesh(scenery.mesh_chunks, scenery.mesh);
  use(shadow_, view, far, kOcclusionBias, nullptr);
  draw_shadows(scenery.shadows, true);
  if (scenery.glass.empty()) return;
  use(scenery_, view, far, 0, &R_optical_map);
  place(scenery_, scenery, R_optical_map.transpose());
  gl_.Enable(GL_BLEND);
  gl_.BlendEquation(GL_FUNC_ADD);
  gl_.BlendFunc(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA);
  gl_.DepthMask(GL_FALSE);
  draw_instances(plain_box_, scenery.glass);
  gl_.DepthMask(GL_TRUE);
  gl_.Disable(GL_BLEND);
}

}  // namespace parhelion::render
