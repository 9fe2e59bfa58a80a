#include "daemon/tacho_watch.h"

#include <algorithm>
#include <cmath>

namespace emtb {

std::int64_t TachoWatch::number_of(double t) noexcept { return static_cast<std::int64_t>(std::floor(t / bin_length)); }

void TachoWatch::restart() noexcept {
  bins_.fill({});
  suspicion_ = Fault::none;
}

TachoWatch::Bin& TachoWatch::begun(double t) noexcept {
  const std::int64_t number = number_of(std::max(t, 0.0));
  Bin& at = bin(number);
  if (at.number != number) at = {.number = number};
  return at;
}

Trip TachoWatch::take(const Reading& reading, double window) noexcept {
  switch (reading.signal) {
    case Signal::e_a: {
      Bin& at = begun(reading.time);
      at.e_a += reading.value;
      ++at.count;
      return {};
    }
    case Signal::omega: {
      Bin& at = begun(reading.time);
      at.slowest = std::min(at.slowest, reading.value);
      at.fastest = std::max(at.fastest, reading.value);
      return {};
    }
    case Signal::i_a:
      return judge(reading, window);
    default:
      return {};
  }
}

Trip TachoWatch::judge(const Reading& i_a, double window) noexcept {
  Bin all;
  const std::int64_t last = number_of(i_a.time);
  const std::int64_t first = std::max(number_of(i_a.time - window), last - static_cast<std::int64_t>(bins) + 1);
  for (std::int64_t number = std::max<std::int64_t>(first, 0); number <= last; ++number) {
    const Bin& at = bin(number);
    if (at.number != number) continue;
    all.e_a += at.e_a;
    all.count += at.count;
    all.slowest = std::min(all.slowest, at.slowest);
    all.fastest = std::max(all.fastest, at.fastest);
  }
  if (all.count == 0 || all.slowest > all.fastest) return {};

  const double e_a = all.e_a / all.count;
  const double emf = e_a - R_a_ * i_a.value;
  const double direction = emf > 0 ? 1 : -1;
  Fault suspicion = Fault::none;
  if (std::abs(emf) > settings_.emf && e_a * direction > 0) {
    const double most = direction > 0 ? all.fastest : -all.slowest;   // that the tacho turned the right way
    const double least = direction > 0 ? all.slowest : -all.fastest;  // and the wrong way, where negative
    if (most < -settings_.omega) {
      suspicion = Fault::reversed_tacho;
    } else if (most < settings_.omega && least > -settings_.omega) {
      suspicion = Fault::dead_tacho;
    }
  }
  if (suspicion != suspicion_) since_ = i_a.time;
  suspicion_ = suspicion;
  if (suspicion == Fault::none || i_a.time - since_ < settings_.time) return {};
  return {suspicion, Signal::e_a, emf};
}

}  // namespace emtb
