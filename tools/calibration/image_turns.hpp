// How far a camera on a robot's base turns from one image to the next: corners of the image are found again
// in the next one (Shi and Tomasi, "Good features to track", CVPR 1994; normalised correlation of patches),
// and the turn about the vertical is what their directions have in common.
#pragma once

#include <memory>
#include <vector>

#include "fusion/pose/calibration/turn_path.hpp"
#include "protocols/image.hpp"
#include "protocols/status.hpp"

namespace parhelion::tools {

/// Counts of what images could not tell.
struct ImageTurnCounts {
  std::size_t images = 0;
  std::size_t refused = 0;    ///< could not be decoded, or have another size than the camera
  std::size_t unmatched = 0;  ///< have too little in common with the image before
};

class ImageTurns {
 public:
  /// Error: a camera that is carried by joints, as it turns by itself, or without calibration.
  static Result<ImageTurns> create(const CameraDescription& camera);
  ImageTurns(ImageTurns&&) noexcept;
  ImageTurns& operator=(ImageTurns&&) noexcept;
  ~ImageTurns();

  /// In the order of the stamps; images up to half a second after the one before are compared with it. The
  /// exposure of a rolling shutter counts as that of its middle row.
  void add(const Image& image);
  /// Turns of base_link, by stamps of the images.
  const std::vector<pose::Turn>& turns() const;
  const ImageTurnCounts& counts() const;

 private:
  struct State;
  explicit ImageTurns(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace parhelion::tools
