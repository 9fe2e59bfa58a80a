#pragma once

#include <cstddef>
#include <span>

#include "session/session.h"

namespace emtb {

/// Rows from one update of a signal to the next, where a logger writes it more often than its instrument reads: 1 where
/// it changes at any row. Told by the rows at which it changes, where those are too many to be so by chance.
/// @param first the row of the first update
std::size_t rows_an_update(std::span<const double> value, std::size_t* first = nullptr);

/// Does a log write the last value of a signal again in rows that are those of others, at no fixed rate? Told where the
/// signal moves by several of its steps from row to row, and stays in many rows all the same.
bool repeats_unevenly(std::span<const double> value);

/// Either: rows that only repeat the one before.
bool repeats(std::span<const double> value);

/// The series without the rows that only repeat the one before: a reading counts once, and its noise is that between
/// updates.
Series updates_of(const Series& series);

/// The same where the repeats may be uneven: what stays for long is then taken to be read at about the usual rate.
Series readings_of(const Series& series);

/// The series with the rows that only repeat the one before on the straight line from update to update: what is held is
/// late, by half of the rows between them in the mean.
Series straight_between_updates(const Series& series);

}  // namespace emtb
