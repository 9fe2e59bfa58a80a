#!/usr/bin/env bash
# From nothing to a diagnosed motor through the installed package, in a fresh Debian 12: needs root, mmdebstrap and a network, a
# minute and 500 MB. Not run by ctest.
#   tests/package/in_chroot.sh build/release
set -euo pipefail
build=$(realpath "${1:-build/release}")
work=$(mktemp -d)
root=$work/root
tidy() { if mountpoint -q "$root/proc"; then umount "$root/proc"; fi; rm -rf --one-file-system "$work"; }
trap tidy EXIT
mmdebstrap --quiet --variant=apt bookworm "$root"
(cd "$build" && cpack -G DEB -B "$work" >/dev/null)
cp "$work"/emtb_*.deb "$root/emtb.deb"
inside() { chroot "$root" env DEBIAN_FRONTEND=noninteractive XDG_RUNTIME_DIR=/tmp HOME=/root PATH=/usr/sbin:/usr/bin:/sbin:/bin bash -euc "$1"; }

inside 'apt-get update -qq; apt-get install -y -qq --no-install-recommends /emtb.deb >/log 2>&1; grep "nothing was started" /log'
mount -t proc proc "$root/proc"
inside 'getent passwd emtb >/dev/null; emtb --version; ! [ -e /etc/systemd/system/multi-user.target.wants/emtbd.service ]'
inside 'mkdir /try; cd /try; share=/usr/share/emtb
emtbd --config $share/benches/fh2-simulated.yaml --data sessions --pace max 2>log &
for n in $(seq 100); do if [ -S /tmp/emtb.sock ]; then break; fi; sleep 0.1; done
emtb reset
for p in step_low step_high random staircase; do mv "$(emtb run fh2_$p)" $p.h5; emtb export $p.h5 --out $p.csv; done
kill %1; wait || true
for kind in h5 csv; do
  emtb diagnose $share/models/fh2.yaml step_low.$kind step_high.$kind random.$kind --held-out staircase.$kind | tail -5 | tee answer
  grep -q "missing  coulomb_friction" answer
done'
inside 'mkdir -p /var/lib/emtb/sessions; cp /try/random.h5 /var/lib/emtb/sessions/; echo mine >/etc/emtb/bench.yaml
apt-get purge -y -qq emtb >/log 2>&1; ! [ -e /usr/bin/emtbd ]; [ -e /var/lib/emtb/sessions/random.h5 ]; [ -e /etc/emtb/bench.yaml ]'
echo "installed, used and purged in a fresh Debian 12"
