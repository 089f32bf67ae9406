from spec import make

print(f"{make.write()} vectors made, {len(make.VECTORS)} in all")
