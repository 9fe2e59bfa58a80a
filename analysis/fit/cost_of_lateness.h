#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <vector>

namespace emtb {

/// The cost over how late each instrument is, 0 to 1 sample, less what the model's parameters would take of it. A
/// prediction bends as the lateness passes an edge of the voltage: it is taken as straight from place to place.
class CostOfLateness {
 public:
  static constexpr std::size_t places = 8;  ///< to a sample

  /// What the residuals of a signal say at each place.
  struct OfSignal {
    std::array<double, places + 1> squares{};
    std::array<double, places> products{};                ///< with those at the place after it
    std::array<Eigen::VectorXd, places + 1> gradients{};  ///< of the parameters
  };

  /// @param normal matrix of the parameters @param other their gradient by signals that are never late
  CostOfLateness(std::vector<OfSignal> signals, Eigen::MatrixXd normal, Eigen::VectorXd other);

  /// Half the sum of squares. @param late [samples] of each signal
  double at(const std::vector<double>& late) const;

  /// Where it is least, one signal after the other. @param held not 0 for those that are not late
  std::vector<double> least(const std::vector<char>& held) const;

 private:
  double least_of(std::vector<double> late, std::size_t c) const;

  std::vector<OfSignal> signals_;
  Eigen::MatrixXd normal_;
  Eigen::VectorXd other_;
};

}  // namespace emtb
