#include "server/listening.h"

#include <grp.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <string>

#include "hal/error.h"

namespace emtb {
namespace {

std::string reason(int error) { return std::strerror(error); }

int new_socket(const std::string& name) {
  const int made = ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (made < 0) throw ProtocolError(name + ": the socket cannot be made: " + reason(errno));
  return made;
}

/// Removes what a dead daemon left. @throws ProtocolError where something else is there
void clear_the_way(const std::filesystem::path& path, const sockaddr_un& address) {
  const std::string name = path.string();
  std::error_code ignored;
  const auto status = std::filesystem::symlink_status(path, ignored);
  if (!std::filesystem::exists(status)) return;
  if (!std::filesystem::is_socket(status)) throw ProtocolError(name + ": is there already and is not a socket");
  const int probe = new_socket(name);
  const bool answers = connect(probe, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0;
  const int error = errno;
  close(probe);
  if (answers || error == EAGAIN) {  // EAGAIN: more wait there than it has taken
    throw ProtocolError(name + ": another daemon answers there. Stop it, or give another --socket");
  }
  if (error != ECONNREFUSED) throw ProtocolError(name + ": is there already: " + reason(error));
  std::filesystem::remove(path, ignored);
}

}  // namespace

Listening::Listening(const std::filesystem::path& path) : path_(path) {
  const std::string name = path.string();
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (name.size() >= sizeof address.sun_path) {
    throw ProtocolError(name + ": a socket's path has at most " + std::to_string(sizeof address.sun_path - 1) +
                        " bytes. Give a shorter --socket");
  }
  std::memcpy(address.sun_path, name.c_str(), name.size() + 1);
  clear_the_way(path, address);
  socket_ = new_socket(name);
  const mode_t before = umask(0117);  // 0660 from the first moment: chmod afterwards would leave a gap
  const int bound = bind(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof address);
  const int error = errno;
  umask(before);
  struct stat file {};
  if (bound != 0 || lstat(name.c_str(), &file) != 0) {
    close(socket_);
    throw ProtocolError(name + ": the socket cannot be made: " + reason(bound != 0 ? error : errno));
  }
  device_ = file.st_dev;
  inode_ = file.st_ino;
  if (const group* ours = getgrnam("emtb"); ours != nullptr && geteuid() == 0) {
    if (chown(name.c_str(), static_cast<uid_t>(-1), ours->gr_gid) != 0) { /* then it stays root's */
    }
  }
  listen(socket_, SOMAXCONN);
}

Listening::~Listening() {
  close(socket_);
  struct stat file {};
  if (lstat(path_.c_str(), &file) == 0 && file.st_dev == device_ && file.st_ino == inode_) unlink(path_.c_str());
}

}  // namespace emtb
