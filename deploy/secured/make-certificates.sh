#!/bin/sh
# Makes a certificate authority and certificates for the daemon and its clients, for tests and small fleets.
#
#   make-certificates.sh DIR [--host NAME_OR_ADDRESS]... [--days N] [ROLE]...
#
# Leaves in DIR: ca.pem and ca.key, pdnd.pem and pdnd.key for the daemon, and ROLE.pem and ROLE.key for each
# role (vehicle, operator and observer if none is named). The role stands in the certificate as its common
# name, which is what zenoh.json5 beside this file goes by. The daemon's certificate is for localhost,
# 127.0.0.1, ::1 and each --host: clients refuse an address that it does not name. What is in DIR already is
# kept, so that certificates can be added later; to renew one, remove it first. Keep ca.key away from the
# vehicle: who has it can be anyone.
set -eu
umask 077

fail() { echo "make-certificates.sh: $1" >&2; exit 2; }

command -v openssl >/dev/null || fail "needs openssl"
[ $# -ge 1 ] || fail "name a directory; the head of this file says more"
dir=$1; shift
days=825
names="DNS:localhost,IP:127.0.0.1,IP:::1"
roles=
while [ $# -gt 0 ]; do
  case $1 in
    --host)
      [ $# -ge 2 ] || fail "--host needs a name or an address"
      case $2 in
        *:* | *[!0-9.]*) case $2 in *:*) kind=IP ;; *) kind=DNS ;; esac ;;
        *) kind=IP ;;
      esac
      names="$names,$kind:$2"; shift 2 ;;
    --days)
      [ $# -ge 2 ] || fail "--days needs a number"
      days=$2; shift 2 ;;
    -*) fail "there is no option $1" ;;
    *[!a-z0-9_-]*) fail "a role consists of a-z, 0-9, - and _, unlike $1" ;;
    *) roles="$roles $1"; shift ;;
  esac
done
mkdir -p "$dir"

# issue NAME EXTENSIONS: a key, and a certificate signed by the authority.
issue() {
  [ -e "$dir/$1.pem" ] && return
  openssl req -new -newkey ec -pkeyopt ec_paramgen_curve:prime256v1 -nodes -keyout "$dir/$1.key" \
    -subj "/O=pdn/CN=$1" -out "$dir/$1.csr" 2>/dev/null
  printf 'basicConstraints=critical,CA:FALSE\nkeyUsage=critical,digitalSignature\n%b\n' "$2" > "$dir/$1.ext"
  openssl x509 -req -in "$dir/$1.csr" -CA "$dir/ca.pem" -CAkey "$dir/ca.key" -CAcreateserial -days "$days" \
    -sha256 -extfile "$dir/$1.ext" -out "$dir/$1.pem" 2>/dev/null
  rm -f "$dir/$1.csr" "$dir/$1.ext"
  chmod 644 "$dir/$1.pem"
  echo "$dir/$1.pem"
}

if [ ! -e "$dir/ca.pem" ]; then
  openssl req -x509 -newkey ec -pkeyopt ec_paramgen_curve:prime256v1 -nodes -keyout "$dir/ca.key" -sha256 \
    -days 3650 -subj "/O=pdn/CN=pdn authority" -out "$dir/ca.pem" \
    -addext "basicConstraints=critical,CA:TRUE,pathlen:0" \
    -addext "keyUsage=critical,keyCertSign,cRLSign" 2>/dev/null
  chmod 644 "$dir/ca.pem"
  echo "$dir/ca.pem"
fi
# The daemon is also a client: `pdnd health` asks it.
issue pdnd "extendedKeyUsage=serverAuth,clientAuth\nsubjectAltName=$names"
for role in ${roles:-vehicle operator observer}; do
  issue "$role" "extendedKeyUsage=clientAuth\nsubjectAltName=DNS:$role"
done
