#pragma once

#include "session/session.h"

namespace emtb {

/// Does the motor say that its voltage went on where the reading of it stands? A driver ends at its highest voltage by
/// itself, and current and speed then follow from what is read, e = R i + K omega, as in all other rows. Where they ask
/// for clearly more in the rows that stand, it is the reading that ends.
/// @param value [V] at which the reading of e_a stands, its largest or smallest
bool motor_takes_more(const Run& run, double value);

}  // namespace emtb
