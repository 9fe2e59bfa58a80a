#include "session/table_file.h"

#include "hal/error.h"
#include "session/h5.h"
#include "session/replace.h"

namespace emtb {
namespace {

using h5::check;
using h5::Id;

Id text_type() {
  Id type(check(H5Tcopy(H5T_C_S1)));
  check(H5Tset_size(type, H5T_VARIABLE));
  check(H5Tset_cset(type, H5T_CSET_UTF8));
  return type;
}

void attach(hid_t object, const std::string& name, const std::string& text) {
  const Id type = text_type(), one(check(H5Screate(H5S_SCALAR)));
  const Id attribute(check(H5Acreate2(object, name.c_str(), type, one, H5P_DEFAULT, H5P_DEFAULT)));
  const char* words = text.c_str();
  check(H5Awrite(attribute, type, &words));
}

/// Of objects that do not hold when they were made: the same table is the same file, byte for byte.
Id timeless(hid_t kind) {
  Id properties(check(H5Pcreate(kind)));
  check(H5Pset_obj_track_times(properties, false));
  return properties;
}

void write(hid_t group, const TableColumn& column) {
  const bool is_text = !column.texts.empty();
  const hsize_t rows = is_text ? column.texts.size() : column.numbers.size();
  const Id space(check(H5Screate_simple(1, &rows, nullptr)));
  const Id type = is_text ? text_type() : Id(check(H5Tcopy(H5T_NATIVE_DOUBLE)));
  const Id properties = timeless(H5P_DATASET_CREATE);
  const Id data(check(H5Dcreate2(group, column.name.c_str(), type, space, H5P_DEFAULT, properties, H5P_DEFAULT)));
  if (is_text) {
    std::vector<const char*> words;
    for (const std::string& text : column.texts) words.push_back(text.c_str());
    check(H5Dwrite(data, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, words.data()));
    return;
  }
  check(H5Dwrite(data, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, column.numbers.data()));
  attach(data, "unit", column.unit);
}

}  // namespace

void write_table(const std::filesystem::path& path, const std::vector<TableColumn>& columns,
                 const std::map<std::string, std::string>& attributes) {
  replace_file(path, [&](const std::filesystem::path& draft) {
    const h5::Quiet quiet;
    try {
      const Id file(check(H5Fcreate(draft.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT)));
      for (const auto& [name, text] : attributes) attach(file, name, text);
      const Id properties = timeless(H5P_GROUP_CREATE);
      const Id group(check(H5Gcreate2(file, "table", H5P_DEFAULT, properties, H5P_DEFAULT)));
      for (const TableColumn& column : columns) write(group, column);
    } catch (const h5::Failure& e) {
      throw SessionError(path.string() + ": cannot be written" + e.what());
    }
  });
}

}  // namespace emtb
