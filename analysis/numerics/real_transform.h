#pragma once

#include <complex>
#include <memory>
#include <mutex>
#include <span>
#include <vector>

namespace emtb {

/// The Fourier transform of real series. What depends on their length alone is kept, so that many of one length need it
/// once; not for two threads at a time.
class RealTransform {
 public:
  RealTransform();
  ~RealTransform();
  RealTransform(const RealTransform&) = delete;
  RealTransform& operator=(const RealTransform&) = delete;

  /// X(k) = sum over j of x(j) exp(-2 pi i j k/n),  k = 0 ... n/2; good until the next call.
  /// @param x of n values, at least 4
  std::span<const std::complex<double>> of(const std::vector<double>& x);

 private:
  struct Plans;
  std::unique_ptr<Plans> plans_;
  std::vector<std::complex<double>> transformed_;
};

/// Some transforms, for as many threads as ask for one at a time.
class RealTransforms {
 public:
  /// Calls f with a transform that nobody else has meanwhile.
  template <class Function>
  auto with_one(const Function& f) {
    std::unique_ptr<RealTransform> mine = take();
    auto result = f(*mine);
    give_back(std::move(mine));
    return result;
  }

 private:
  std::unique_ptr<RealTransform> take();
  void give_back(std::unique_ptr<RealTransform> transform);

  std::mutex mutex_;
  std::vector<std::unique_ptr<RealTransform>> idle_;
};

}  // namespace emtb
