def write_report(folder, results, model):
    for way, r in results.items():
        for n, f in r.flexible.items():
            print(way, n, f.fit.at_bounds)
            for k, v in f.free.items(): print('   ', k, v)
    return []
