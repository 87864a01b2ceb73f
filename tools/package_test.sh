#!/usr/bin/env bash
# Installs the packages as a user does, in an empty Debian 12, and uses them: tools/package_test.sh [PACKAGES]
# On a Debian 12 with debootstrap; takes other packages from where this machine's apt has them from.
set -euo pipefail
[[ $EUID -eq 0 ]] || exec sudo "$0" "$@"  # a root folder is root's
cd "$(dirname "${BASH_SOURCE[0]}")/.."
packages=$(realpath "${1:-build/package}")
mirror=$(apt-get indextargets --format '$(REPO_URI)' 'Created-By: Packages' 'Codename: bookworm' 'Origin: Debian' |
  awk 'NR == 1')
root=$(mktemp -d)
readonly packages mirror root
trap 'rm -rf --one-file-system "$root"' EXIT

# step WHAT COMMAND... prints one line, or what the command said if it failed
step() {
  local what=$1 log
  shift
  log=$("$@" 2>&1) || { printf 'failed  %s\n%s\n' "$what" "$log"; exit 1; }
  printf 'ok      %s\n' "$what"
}
# In the root, without this machine's variables.
inside() {
  env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin DEBIAN_FRONTEND=noninteractive LC_ALL=C.UTF-8 chroot "$root" bash -ec "$1"
}
install() { inside "apt-get install --yes --no-install-recommends $*"; }

bare_debian() {
  debootstrap --variant=minbase bookworm "$root" "$mirror"
  cp -r "$packages" "$root/packages"
  cp -r data/demo "$root/demo"
  cp -r tests/consumer "$root/consumer"
  chmod -R a+rX "$root/packages"  # apt reads them as a user of its own
}
completes() {
  inside 'source /usr/share/bash-completion/completions/trundle
          COMP_WORDS=(trundle cal); COMP_CWORD=1; _trundle; [[ ${COMPREPLY[*]} == calibrate ]]'
}
consumer() {
  inside 'cmake -S consumer -B consumer/build; cmake --build consumer/build
          [[ $(consumer/build/consumer) == "consumer: 3.142 diameters" ]]'
}

step "an empty Debian 12" bare_debian
step "apt install ./trundle_*.deb" install './packages/trundle_*.deb'
step "it needs no package for compilers" inside '! dpkg-query --show --showformat "\${Package}\n" | grep -e -dev'
step "trundle --version" inside 'trundle --version'
step "trundle info" inside 'trundle info demo/session_01/tour --robot demo/robot.toml'
step "completion" completes
step "apt install man-db" install man-db
step "man trundle" inside 'man trundle | grep "^EXIT STATUS"'
step "apt install ./libtrundle-dev_*.deb" install './packages/libtrundle-dev_*.deb'
step "apt install g++ cmake make" install g++ cmake make
step "a CMake project with trundle::trundle" consumer
step "apt purge" inside 'apt-get purge --yes trundle libtrundle-dev
                         ! find /usr /etc /var -not -path "/var/log/*" -name "*trundle*" | grep .'
