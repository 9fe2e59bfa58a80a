#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "hal/shared_column.h"

namespace emtb {

/// A column of errors, one for each reading or grid point, which several may hold. Seven digits of an error do, and
/// those of an hour take half the memory.
class ErrorColumn {
 public:
  ErrorColumn() = default;
  explicit ErrorColumn(std::span<const double> errors);

  std::size_t size() const noexcept { return numbers_.size(); }
  bool empty() const noexcept { return numbers_.empty(); }
  double operator[](std::size_t i) const noexcept { return static_cast<double>(numbers_[i]); }
  const float* data() const noexcept { return numbers_.data(); }
  double largest() const;  ///< 0: none
  std::vector<double> values() const;

  void assign(std::size_t count, double error) { numbers_.assign(count, static_cast<float>(error)); }
  void push_back(double error) { numbers_.push_back(static_cast<float>(error)); }

  /// Raises those of a stretch, its last one as well, to an error at the least.
  void widen(std::size_t first, std::size_t last, double error);

 private:
  SharedColumn<float> numbers_;
};

}  // namespace emtb
