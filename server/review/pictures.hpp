// Selects the pictures of MR_CAMERA that a review shows.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "protocols/status.hpp"

namespace parhelion::review {

struct Picture {
  double t = 0;  ///< s, publication time
  int width = 0, height = 0;
  std::vector<std::uint8_t> jpeg;
};

/// Stores encoded messages and decodes only the selected ones.
class PictureChoice {
 public:
  /// At most `max_deductions` pictures for deductions (the largest ones), and `strip` pictures at equal
  /// intervals.
  PictureChoice(std::size_t max_deductions, std::size_t strip)
      : max_deductions_(max_deductions), max_strip_(strip) {}

  /// MR_CAMERA as it was logged.
  void saw(double t, std::vector<std::uint8_t>&& message);
  /// A deduction at this instant: the last published picture is kept.
  void handle_deduction(double points);
  std::uint64_t seen() const { return seen_; }

  /// As JPEG, in the order of time. Messages that are no image or cannot be shown are left out and counted in
  /// `unreadable`.
  std::vector<Picture> finish(std::uint64_t& unreadable) const;

 private:
  struct Frame {
    double t;
    std::vector<std::uint8_t> message;
  };
  struct DeductionPicture {
    double points;
    std::shared_ptr<const Frame> frame;
  };
  std::size_t max_deductions_, max_strip_;
  std::shared_ptr<const Frame> last_;
  std::vector<DeductionPicture> deduction_pictures_;
  std::vector<std::shared_ptr<const Frame>> strip_;
  double strip_interval_ = 1, strip_next_ = 0;  // s
  std::uint64_t seen_ = 0;
};

}  // namespace parhelion::review
