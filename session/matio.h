#pragma once

// What the session room needs of libmatio, with variables that free themselves. Private to session/.

#include <matio.h>

#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace emtb::mat {

struct Free {
  void operator()(matvar_t* v) const noexcept { Mat_VarFree(v); }
  void operator()(mat_t* m) const noexcept { Mat_Close(m); }
};
using Variable = std::unique_ptr<matvar_t, Free>;
using File = std::unique_ptr<mat_t, Free>;

/// Real numbers of whatever class, in the order of memory; nothing where the variable holds others or none.
std::optional<std::vector<double>> numbers(const matvar_t* variable);

/// A row of characters, as UTF-8.
std::optional<std::string> text(const matvar_t* variable);

/// A field of a struct (array); null where it is not there.
matvar_t* field(matvar_t* variable, const char* name, std::size_t element = 0);
std::vector<std::string> fields(const matvar_t* variable);

/// How many elements an array has.
std::size_t count(const matvar_t* variable);

/// A column of numbers, a number, a text. Each throws std::bad_alloc where there is no memory.
Variable column(const char* name, const std::vector<double>& values);
Variable of(const char* name, double value);
Variable of(const char* name, const std::string& value);
Variable structure(const char* name, std::size_t elements, const std::vector<std::string>& fields);
void set(const Variable& structure, const std::string& field, Variable value, std::size_t element = 0);
Variable cells(const char* name, const std::vector<std::string>& texts);

}  // namespace emtb::mat
