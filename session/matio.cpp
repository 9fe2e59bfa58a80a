#include "session/matio.h"

#include <array>
#include <cstdint>
#include <new>

namespace emtb::mat {
namespace {

Variable made(matvar_t* variable) {
  if (variable == nullptr) throw std::bad_alloc();
  return Variable(variable);
}

template <class T>
std::vector<double> as_doubles(const matvar_t* v) {
  const T* const first = static_cast<const T*>(v->data);
  return {first, first + count(v)};
}

template <class Unit>
void append_utf8(std::string& out, const matvar_t* v) {
  const Unit* const first = static_cast<const Unit*>(v->data);
  for (const Unit* at = first; at != first + count(v); ++at) {
    const auto c = static_cast<std::uint32_t>(*at);
    if (c < 0x80) {
      out += static_cast<char>(c);
    } else if (c < 0x800) {
      out += {static_cast<char>(0xC0U | c >> 6), static_cast<char>(0x80U | (c & 0x3FU))};
    } else {
      out += {static_cast<char>(0xE0U | (c >> 12 & 0xFU)), static_cast<char>(0x80U | (c >> 6 & 0x3FU)),
              static_cast<char>(0x80U | (c & 0x3FU))};
    }
  }
}

/// Of UTF-8; what needs two units becomes a question mark.
std::vector<std::uint16_t> utf16(const std::string& text) {
  std::vector<std::uint16_t> out;
  for (std::size_t i = 0; i < text.size();) {
    const auto lead = static_cast<unsigned char>(text[i++]);
    const int more = lead >= 0xF0 ? 3 : lead >= 0xE0 ? 2 : lead >= 0xC0 ? 1 : 0;
    std::uint32_t c = more == 0 ? lead : lead & (0x3FU >> more);
    for (int k = 0; k < more && i < text.size(); ++k) c = c << 6 | (static_cast<unsigned char>(text[i++]) & 0x3FU);
    out.push_back(c > 0xFFFF ? std::uint16_t{'?'} : static_cast<std::uint16_t>(c));
  }
  return out;
}

}  // namespace

std::size_t count(const matvar_t* v) {
  std::size_t n = v->rank > 0 ? 1 : 0;
  for (int k = 0; k < v->rank; ++k) n *= v->dims[k];
  return n;
}

std::optional<std::vector<double>> numbers(const matvar_t* v) {
  if (v == nullptr || v->isComplex != 0 || v->class_type == MAT_C_CHAR) return std::nullopt;
  if (v->class_type < MAT_C_DOUBLE || v->class_type > MAT_C_UINT64) return std::nullopt;
  if (count(v) == 0) return std::vector<double>{};
  if (v->data == nullptr || v->nbytes < count(v) * static_cast<std::size_t>(v->data_size)) return std::nullopt;
  switch (v->data_type) {
    case MAT_T_DOUBLE:
      return as_doubles<double>(v);
    case MAT_T_SINGLE:
      return as_doubles<float>(v);
    case MAT_T_INT8:
      return as_doubles<std::int8_t>(v);
    case MAT_T_UINT8:
      return as_doubles<std::uint8_t>(v);
    case MAT_T_INT16:
      return as_doubles<std::int16_t>(v);
    case MAT_T_UINT16:
      return as_doubles<std::uint16_t>(v);
    case MAT_T_INT32:
      return as_doubles<std::int32_t>(v);
    case MAT_T_UINT32:
      return as_doubles<std::uint32_t>(v);
    case MAT_T_INT64:
      return as_doubles<std::int64_t>(v);
    case MAT_T_UINT64:
      return as_doubles<std::uint64_t>(v);
    default:
      return std::nullopt;
  }
}

std::optional<std::string> text(const matvar_t* v) {
  if (v == nullptr || v->class_type != MAT_C_CHAR) return std::nullopt;
  std::string out;
  if (count(v) == 0 || v->data == nullptr) return out;
  switch (v->data_type) {
    case MAT_T_UTF8:
      return std::string(static_cast<const char*>(v->data), v->nbytes);
    case MAT_T_INT8:
    case MAT_T_UINT8:
      append_utf8<std::uint8_t>(out, v);
      return out;
    case MAT_T_UTF16:
    case MAT_T_UINT16:
      append_utf8<std::uint16_t>(out, v);
      return out;
    default:
      return std::nullopt;
  }
}

matvar_t* field(matvar_t* v, const char* name, std::size_t element) {
  if (v == nullptr || v->class_type != MAT_C_STRUCT || element >= count(v)) return nullptr;
  return Mat_VarGetStructFieldByName(v, name, element);
}

std::vector<std::string> fields(const matvar_t* v) {
  std::vector<std::string> names;
  if (v == nullptr || v->class_type != MAT_C_STRUCT) return names;
  const unsigned n = Mat_VarGetNumberOfFields(const_cast<matvar_t*>(v));
  char* const* const all = Mat_VarGetStructFieldnames(v);
  for (unsigned k = 0; all != nullptr && k < n; ++k) names.emplace_back(all[k]);
  return names;
}

Variable column(const char* name, const std::vector<double>& values) {
  std::array<std::size_t, 2> size{values.size(), 1};
  return made(Mat_VarCreate(name, MAT_C_DOUBLE, MAT_T_DOUBLE, 2, size.data(), const_cast<double*>(values.data()), 0));
}

Variable of(const char* name, double value) { return column(name, {value}); }

Variable of(const char* name, const std::string& value) {
  auto units = utf16(value);
  std::array<std::size_t, 2> size{units.empty() ? 0U : 1U, units.size()};
  return made(Mat_VarCreate(name, MAT_C_CHAR, MAT_T_UINT16, 2, size.data(), units.data(), 0));
}

Variable structure(const char* name, std::size_t elements, const std::vector<std::string>& names) {
  std::vector<const char*> pointers;
  for (const std::string& one : names) pointers.push_back(one.c_str());
  pointers.push_back(nullptr);  // ends them
  const std::array<std::size_t, 2> size{1, elements};
  return made(Mat_VarCreateStruct2(name, 2, size.data(), pointers.data()));
}

void set(const Variable& structure, const std::string& name, Variable value, std::size_t element) {
  Mat_VarSetStructFieldByName(structure.get(), name.c_str(), element, value.release());
}

Variable cells(const char* name, const std::vector<std::string>& texts) {
  std::vector<matvar_t*> all;
  for (const std::string& one : texts) all.push_back(of(nullptr, one).release());
  std::array<std::size_t, 2> size{all.size(), 1};
  return made(Mat_VarCreate(name, MAT_C_CELL, MAT_T_CELL, 2, size.data(), all.data(), 0));
}

}  // namespace emtb::mat
