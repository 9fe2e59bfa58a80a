#include "analysis/record/error_column.h"

#include <algorithm>
#include <utility>

namespace emtb {

ErrorColumn::ErrorColumn(std::span<const double> errors) {
  std::vector<float> numbers;
  numbers.reserve(errors.size());
  for (const double error : errors) numbers.push_back(static_cast<float>(error));
  numbers_ = SharedColumn<float>(std::move(numbers));
}

double ErrorColumn::largest() const {
  return numbers_.empty() ? 0 : static_cast<double>(*std::max_element(numbers_.begin(), numbers_.end()));
}

std::vector<double> ErrorColumn::values() const {
  std::vector<double> all(size());
  for (std::size_t i = 0; i < size(); ++i) all[i] = (*this)[i];
  return all;
}

void ErrorColumn::widen(std::size_t first, std::size_t last, double error) {
  const std::span<float> numbers = numbers_.edit();
  for (std::size_t i = first; i <= last; ++i) numbers[i] = std::max(numbers[i], static_cast<float>(error));
}

}  // namespace emtb
