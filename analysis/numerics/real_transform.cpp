#include "analysis/numerics/real_transform.h"

#include <unsupported/Eigen/FFT>

namespace emtb {

struct RealTransform::Plans {
  Eigen::FFT<double> fft;
};

RealTransform::RealTransform() : plans_(std::make_unique<Plans>()) {
  plans_->fft.SetFlag(Eigen::FFT<double>::HalfSpectrum);
}

RealTransform::~RealTransform() = default;

std::span<const std::complex<double>> RealTransform::of(const std::vector<double>& x) {
  plans_->fft.fwd(transformed_, x);
  return transformed_;
}

std::unique_ptr<RealTransform> RealTransforms::take() {
  const std::lock_guard lock(mutex_);
  if (idle_.empty()) return std::make_unique<RealTransform>();
  std::unique_ptr<RealTransform> one = std::move(idle_.back());
  idle_.pop_back();
  return one;
}

void RealTransforms::give_back(std::unique_ptr<RealTransform> transform) {
  const std::lock_guard lock(mutex_);
  idle_.push_back(std::move(transform));
}

}  // namespace emtb
